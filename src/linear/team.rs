//! Threads that go through a computation in step.
//!
//! An iteration of conjugate gradients on a few thousand rows has three phases of 10 to 40 µs.
//! Handing each phase to a thread pool costs about 25 µs of waking and gained nothing at two
//! threads; threads that stay and spin at barriers took a step of `drape` from 7.7 to 5.1 ms.

use std::cell::Cell;
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};

/// Held by the one team that may work at a time.
static TEAM: Mutex<()> = Mutex::new(());

/// One thread of a team.
#[derive(Debug)]
pub(crate) struct Member<'a> {
    /// Its number, below `threads`.
    pub(crate) thread: usize,
    /// Threads of the team.
    pub(crate) threads: usize,
    barrier: &'a Barrier,
}

impl Member<'_> {
    /// Waits until the whole team has come here.
    pub(crate) fn wait(&self) {
        self.barrier.wait();
    }

    /// The member's own of `count` pieces of work: all pieces in a row, shared out evenly.
    pub(crate) fn share(&self, count: usize) -> Range<usize> {
        let start = |thread: usize| count * thread / self.threads;
        start(self.thread)..start(self.thread + 1)
    }
}

/// Goes through some work with at most `threads` threads of the pool it is called in, each as a
/// member of one team, and returns what the first came to.
///
/// Two teams in one pool would spin while they wait for each other's threads: whoever comes second
/// works alone.
pub(crate) fn run<T: Default + Send>(threads: usize, work: impl Fn(&Member<'_>) -> T + Sync) -> T {
    let threads = threads.min(rayon::current_num_threads());
    let team = TEAM.try_lock();
    if threads <= 1 || team.is_err() {
        let barrier = &Barrier::new(1);
        return work(&Member {
            thread: 0,
            threads: 1,
            barrier,
        });
    }
    let barrier = &Barrier::new(threads);
    let _leads = Leads::begin();
    let results = rayon::broadcast(|context| {
        let thread = context.index();
        (thread < threads).then(|| {
            work(&Member {
                thread,
                threads,
                barrier,
            })
        })
    });
    results.into_iter().flatten().next().unwrap_or_default()
}

thread_local! {
    /// Whether this thread waits for the members of a team that it called.
    static LEADS: Cell<bool> = const { Cell::new(false) };
}

/// Marks the thread as one that leads a team, also when the work panics.
struct Leads;

impl Leads {
    fn begin() -> Self {
        LEADS.set(true);
        Self
    }
}

impl Drop for Leads {
    fn drop(&mut self) {
        LEADS.set(false);
    }
}

/// A barrier at which threads spin.
#[derive(Debug)]
struct Barrier {
    threads: usize,
    arrived: AtomicUsize,
    round: AtomicUsize,
}

/// Turns of the spinning loop, some 15 µs, after which a thread gives its core away: the others may
/// be waiting for one.
const PATIENCE: u32 = 300;

impl Barrier {
    fn new(threads: usize) -> Self {
        Self {
            threads,
            arrived: AtomicUsize::new(0),
            round: AtomicUsize::new(0),
        }
    }

    /// Waits until every thread has come here.
    fn wait(&self) {
        let round = self.round.load(Ordering::Acquire);
        if self.arrived.fetch_add(1, Ordering::AcqRel) + 1 == self.threads {
            self.arrived.store(0, Ordering::Relaxed);
            self.round.store(round.wrapping_add(1), Ordering::Release);
            return;
        }
        let mut turns = 0;
        while self.round.load(Ordering::Acquire) == round {
            turns += 1;
            if turns < PATIENCE {
                std::hint::spin_loop();
            } else {
                std::thread::yield_now();
            }
        }
    }
}

/// Does some work that goes through many short parallel loops, while the pool's other threads look
/// for their shares of them without going to sleep in between.
///
/// A sleeping thread takes some 25 µs to wake, as long as its share of a loop.
pub fn awake<T>(work: impl FnOnce() -> T) -> T {
    if LEADS.get() {
        return work(); // taken up while a team waits for this thread, which must not wait for the team
    }
    let others = rayon::current_num_threads() - 1;
    let Some(own) = rayon::current_thread_index().filter(|_| others > 0) else {
        return work(); // outside of a pool, or alone in it
    };
    let (arrived, done) = (AtomicUsize::new(0), AtomicBool::new(false));
    rayon::in_place_scope(|scope| {
        // One job a thread, which no other can take: the thread that works must never keep watch.
        scope.spawn_broadcast(|_, thread| {
            if thread.index() != own && enter(&arrived) {
                watch(&done);
            }
        });
        let _done = SetOnDrop(&done);
        let mut turns = 0;
        while turns < PATIENCE && arrived.load(Ordering::Acquire) < others {
            turns += 1;
            std::hint::spin_loop();
        }
        arrived.fetch_or(CLOSED, Ordering::AcqRel);
        work()
    })
}

/// Marks that no more threads may begin to watch.
///
/// A thread that waits for the rest of a loop takes other jobs meanwhile. If it took the watch then,
/// the loop would wait for the watch and the watch for the loop: none begins after the first loop.
const CLOSED: usize = 1 << (usize::BITS - 1);

/// Counts a thread that comes in time.
fn enter(arrived: &AtomicUsize) -> bool {
    let one_more = |count: usize| (count & CLOSED == 0).then_some(count + 1);
    arrived
        .fetch_update(Ordering::AcqRel, Ordering::Acquire, one_more)
        .is_ok()
}

/// Does what other threads leave to be done, until there will be no more.
fn watch(done: &AtomicBool) {
    let mut turns = 0;
    while !done.load(Ordering::Acquire) {
        if rayon::yield_now() == Some(rayon::Yield::Executed) {
            turns = 0;
        } else if turns < PATIENCE {
            turns += 1;
            std::hint::spin_loop();
        } else {
            std::thread::yield_now();
        }
    }
}

/// Ends the watch, also when the work panics.
struct SetOnDrop<'a>(&'a AtomicBool);

impl Drop for SetOnDrop<'_> {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Release);
    }
}

/// One partial sum a chunk. Every thread adds them up in the same order, so all get the same bits.
#[derive(Debug)]
pub(super) struct Sums(Vec<AtomicU64>);

impl Sums {
    pub(super) fn new(chunks: usize) -> Self {
        Self((0..chunks).map(|_| AtomicU64::new(0)).collect())
    }

    pub(super) fn set(&self, chunk: usize, sum: f64) {
        self.0[chunk].store(sum.to_bits(), Ordering::Relaxed);
    }

    /// The sum over all chunks; a barrier must lie between this and the last [`Sums::set`].
    pub(super) fn total(&self) -> f64 {
        self.0
            .iter()
            .map(|sum| f64::from_bits(sum.load(Ordering::Relaxed)))
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;

    /// Loops within loops, several works at once in one pool, and a work that panics: all come to
    /// an end.
    #[test]
    fn works_end_whoever_watches() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build();
        let loops = |_| {
            for _ in 0..300 {
                let mut list = [1_u64; 64];
                awake(|| {
                    for _ in 0..5 {
                        list.par_iter_mut().for_each(|x| *x += 1);
                    }
                });
                assert!(list.iter().all(|x| *x == 6));
            }
        };
        pool.unwrap().install(|| {
            (0..8).into_par_iter().for_each(loops);
            let panics = || awake(|| panic!("as it should"));
            assert!(std::panic::catch_unwind(panics).is_err());
            loops(0);
        });
    }

    /// Teams within works that keep threads awake, several at once in one pool, as simulations side by side
    /// have them: each is done once and whole.
    #[test]
    fn teams_work_while_threads_are_kept_awake() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build();
        let steps = |_| {
            for _ in 0..100 {
                let done = AtomicUsize::new(0);
                let mut list = [1_u64; 64];
                let threads = awake(|| {
                    list.par_iter_mut().for_each(|x| *x += 1);
                    let threads = run(3, |member| {
                        for _ in 0..3 {
                            let own = member.share(64).len();
                            done.fetch_add(own, Ordering::Relaxed);
                            member.wait();
                        }
                        member.threads
                    });
                    list.par_iter_mut().for_each(|x| *x += 1);
                    threads
                });
                assert!((1..=3).contains(&threads));
                assert_eq!(done.into_inner(), 3 * 64);
                assert!(list.iter().all(|x| *x == 3));
            }
        };
        pool.unwrap().install(|| {
            steps(0);
            (0..8).into_par_iter().for_each(steps);
        });
    }
}
