// Checks one .glb against the OBJ files of the same frames: see check_glb.
//
//   node check_glb.mjs NODE_MODULES FILE.glb OBJ_DIR PICTURES

import { spawn } from 'node:child_process';
import fs from 'node:fs';
import http from 'node:http';
import os from 'node:os';
import path from 'node:path';
import { createRequire } from 'node:module';

const [modules, glb, objects, pictures] = process.argv.slice(2).map((arg) => path.resolve(arg));
const name = path.basename(glb, '.glb');
const PATIENCE_MS = 300_000;
// Positions go through a difference and a sum in f32: 1e-6 m would be 8 of its steps at 1 m.
const ALLOWED_M = 1e-6;

function fail(reason) {
    console.error(`${name}: ${reason}`);
    process.exit(1);
}

/** Time (s), and vertices of each object by its name. */
function readObj(file) {
    const bodies = {};
    let time, last;
    for (const line of fs.readFileSync(file, 'utf8').split('\n')) {
        if (line.startsWith('#')) time = Number(line.match(/t = (\S+) s/)[1]);
        if (line.startsWith('o ')) last = bodies[line.slice(2)] = [];
        if (line.startsWith('v ')) last.push(...line.slice(2).split(' ').map(Number));
    }
    return { time, bodies };
}

async function validate() {
    const validator = createRequire(path.join(modules, 'x.js'))('gltf-validator');
    const { issues } = await validator.validateBytes(new Uint8Array(fs.readFileSync(glb)));
    const { numErrors, numWarnings, numInfos, numHints } = issues;
    console.log(`${name}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos + numHints} remarks`);
    if (numErrors + numWarnings + numInfos + numHints > 0) fail(JSON.stringify(issues.messages.slice(0, 5)));
}

/** Runs in the page: moves the file to some times, and says where everything is and how it looks. */
const PAGE = `<!doctype html><body style="margin:0"><script type="importmap">
{"imports": {"three": "/three/build/three.module.js", "addons/": "/three/examples/jsm/"}}
</script><script type="module">
const faults = [];
console.error = (...words) => faults.push(words.join(' '));
window.onerror = (fault) => { faults.push(String(fault)); };
const post = (body) => fetch('/result', { method: 'POST', body: JSON.stringify({ ...body, faults }) });
try {
    const THREE = await import('three');
    const { GLTFLoader } = await import('addons/loaders/GLTFLoader.js');
    const times = await (await fetch('/times')).json();
    const gltf = await new GLTFLoader().loadAsync('/file.glb');
    const renderer = new THREE.WebGLRenderer({ antialias: true, preserveDrawingBuffer: true });
    renderer.setSize(800, 600);
    document.body.append(renderer.domElement);
    const scene = new THREE.Scene();
    scene.background = new THREE.Color(0x2c3038);
    const sun = new THREE.DirectionalLight(0xffffff, 2.5);
    sun.position.set(2, 4, 3);
    scene.add(gltf.scene, sun, new THREE.HemisphereLight(0xffffff, 0x404040, 1));
    const box = new THREE.Box3().setFromObject(gltf.scene, true);
    const middle = box.getCenter(new THREE.Vector3());
    const size = box.getSize(new THREE.Vector3()).length();
    const camera = new THREE.PerspectiveCamera(35, 4 / 3, size / 100, size * 10);
    camera.position.copy(middle).add(new THREE.Vector3(0.5, 0.25, 1).setLength(1.45 * size));
    camera.lookAt(middle);
    const mixer = new THREE.AnimationMixer(gltf.scene);
    const action = gltf.animations.length ? mixer.clipAction(gltf.animations[0]) : null;
    action?.setLoop(THREE.LoopOnce);
    if (action) action.clampWhenFinished = true;
    const pixels = () => {
        const gl = renderer.getContext();
        const values = new Uint8Array(4 * 800 * 600);
        gl.readPixels(0, 0, 800, 600, gl.RGBA, gl.UNSIGNED_BYTE, values);
        return values;
    };
    const geometry = (positions, index) => {
        const still = new THREE.BufferGeometry();
        still.setAttribute('position', new THREE.Float32BufferAttribute(positions, 3));
        still.setIndex(index);
        still.computeVertexNormals();
        return still;
    };
    const moments = [];
    for (const time of times) {
        if (action) { action.reset().play(); mixer.setTime(time); }
        gltf.scene.updateMatrixWorld(true);
        renderer.render(scene, camera);
        const picture = renderer.domElement.toDataURL('image/png');
        const moved = pixels();
        const bodies = [];
        const still = new THREE.Group();
        const vertex = new THREE.Vector3();
        gltf.scene.traverse((node) => {
            if (!node.isMesh && !node.isLine && !node.isPoints) return;
            if (node.matrixWorld.determinant() === 0) return; // not its time: scaled to nothing
            const positions = [];
            for (let v = 0; v < node.geometry.attributes.position.count; v++) {
                THREE.Mesh.prototype.getVertexPosition.call(node, v, vertex);
                positions.push(...vertex.applyMatrix4(node.matrixWorld).toArray());
            }
            const up = (node.morphTargetInfluences ?? []).map((w, i) => [i, w]).filter(([, w]) => w !== 0);
            still.add(new node.constructor(geometry(positions, node.geometry.index), node.material));
            bodies.push({ name: node.userData.name ?? node.name, positions, up });
        });
        // The same without morph targets must look the same.
        gltf.scene.visible = false;
        scene.add(still);
        renderer.render(scene, camera);
        scene.remove(still);
        gltf.scene.visible = true;
        const unmoved = pixels();
        let other = 0;
        for (let i = 0; i < moved.length; i += 4) {
            const off = Math.abs(moved[i] - unmoved[i]) + Math.abs(moved[i + 1] - unmoved[i + 1]) + Math.abs(moved[i + 2] - unmoved[i + 2]);
            other += off > 24;
        }
        const behind = [moved[0], moved[1], moved[2]];
        let drawn = 0;
        for (let i = 0; i < moved.length; i += 4) drawn += behind.some((c, k) => moved[i + k] !== c);
        moments.push({ time, bodies, picture, drawn, other });
    }
    await post({ moments, duration: gltf.animations[0]?.duration ?? 0, calls: renderer.info.render });
} catch (fault) {
    faults.push(String(fault.stack ?? fault));
    await post({});
}
</script>`;

/** Opens the page in Chromium and returns what it posts. */
function show(times) {
    const kinds = { '.js': 'text/javascript', '.glb': 'model/gltf-binary' };
    return new Promise((resolve) => {
        const home = fs.mkdtempSync(path.join(os.tmpdir(), 'muslin-chromium-'));
        let browser;
        const server = http.createServer((request, response) => {
            const { pathname } = new URL(request.url, 'http://localhost');
            if (pathname === '/') return response.setHeader('content-type', 'text/html').end(PAGE);
            if (pathname === '/times') return response.end(JSON.stringify(times));
            if (pathname === '/result') {
                const parts = [];
                request.on('data', (part) => parts.push(part));
                request.on('end', () => { response.end(); end(JSON.parse(Buffer.concat(parts))); });
                return;
            }
            const file = pathname === '/file.glb' ? glb : path.join(modules, path.normalize(pathname));
            if (!fs.existsSync(file)) return response.writeHead(404).end();
            response.setHeader('content-type', kinds[path.extname(file)] ?? 'application/octet-stream');
            fs.createReadStream(file).pipe(response);
        });
        const patience = setTimeout(() => end({ faults: ['the page says nothing'] }), PATIENCE_MS);
        function end(result) {
            clearTimeout(patience);
            browser.once('exit', () => {
                // A child that outlives its parent may still write there: what is left is the system's to clear.
                try { fs.rmSync(home, { recursive: true, force: true }); } catch { /* not what is checked */ }
                resolve(result);
            });
            process.kill(-browser.pid, 'SIGKILL'); // its children, too
            server.close();
            server.closeAllConnections();
        }
        server.listen(0, '127.0.0.1', () => {
            const url = `http://127.0.0.1:${server.address().port}/`;
            const flags = ['--headless', '--no-sandbox', '--disable-dev-shm-usage', '--use-gl=angle',
                '--use-angle=swiftshader', '--enable-unsafe-swiftshader', `--user-data-dir=${home}`, url];
            browser = spawn('chromium', flags, { stdio: 'ignore', detached: true }); // a group of its own, to end whole
        });
    });
}

/** Largest distance along an axis (m). */
function apart(a, b) {
    if (a.length !== b.length) fail(`${a.length / 3} vertices for ${b.length / 3}`);
    return a.reduce((most, x, i) => Math.max(most, Math.abs(x - b[i])), 0);
}

await validate();
const frames = fs.readdirSync(objects).sort().map((file) => path.join(objects, file));
// The first, the last, those where a new mesh may take over, and some; and half-way between two.
const chosen = [0, 1, 0.3, 0.6, 0.9].map((part) => (part === 1 ? 1 : Math.round(part * (frames.length - 1))));
const numbers = [...new Set([...chosen, 199, 200, 201, 400, 401, frames.length - 1])];
const recorded = numbers.filter((n) => n < frames.length).sort((a, b) => a - b).map((n) => readObj(frames[n]));
const start = recorded[0].time;
if (frames.length > 2) {
    const [a, b] = [1, 2].map((n) => readObj(frames[n]));
    const bodies = Object.entries(a.bodies).map(([body, from]) =>
        [body, from.map((x, i) => (x + b.bodies[body][i]) / 2)]);
    recorded.splice(1, 0, { time: (a.time + b.time) / 2, bodies: Object.fromEntries(bodies) });
}
const { moments, faults, duration } = await show(recorded.map(({ time }) => time - start));
if (faults.length > 0 || !moments) fail(faults.join('\n'));

// three.js takes blanks and some signs out of names.
const plain = (text) => text.replaceAll(' ', '_').replace(/[[\].:/]/g, '');
let worst = 0;
moments.forEach(({ bodies }, m) => {
    const expected = Object.entries(recorded[m].bodies);
    if (bodies.length !== expected.length) fail(`${bodies.length} bodies for ${expected.length} at ${recorded[m].time} s`);
    for (const [body, positions] of expected) {
        const own = bodies.find((other) => plain(other.name).startsWith(plain(body)));
        if (!own) fail(`no ${body} among ${bodies.map((b) => b.name)}`);
        worst = Math.max(worst, apart(own.positions, positions));
    }
});
const weights = moments.map(({ bodies }) => Math.max(0, ...bodies.flatMap(({ up }) => up.map(([, w]) => w))));
console.log(`${name}: ${frames.length} frames, ${duration.toFixed(3)} s; three.js is ${worst.toExponential(1)} m off at most;`,
    `weights ${weights.map((w) => w.toFixed(3)).join(' ')}`);
if (!(worst <= ALLOWED_M)) fail(`more than ${ALLOWED_M} m`);
// Seams and edges may fall on other pixels.
for (const { time, drawn, other } of moments) {
    if (drawn < 100) fail(`nothing is seen at ${time} s: ${drawn} pixels`);
    if (other > 0.01 * drawn) fail(`at ${time} s ${other} of ${drawn} pixels look other than the frame`);
}
const others = Math.max(...moments.map(({ drawn, other }) => other / drawn));
console.log(`${name}: ${(100 * others).toFixed(2)} % of what is seen looks other than without morph targets at most`);
const seen = [moments[0], moments.at(-1)];
seen.forEach(({ picture }, n) => {
    fs.writeFileSync(path.join(pictures, `${name}-${n}.png`), Buffer.from(picture.split(',')[1], 'base64'));
});
if (frames.length > 1 && seen[0].picture === seen[1].picture) fail('the first and the last picture are the same');
process.exit(0);
