//! Pieces of work side by side, each on one thread.

use crate::study::StudyError;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

/// Does pieces `0..count` of some work on `threads` threads; the results in the order of the pieces.
///
/// Each thread is a pool of its own: a simulation would hand parts of its steps to the others, which
/// have their own.
pub(super) fn each<T: Send>(
    threads: usize,
    count: usize,
    work: impl Fn(usize) -> T + Sync,
) -> Result<Vec<T>, StudyError> {
    let failed = |error: String| StudyError::Threads(error);
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::new());
    let share = || loop {
        let piece = next.fetch_add(1, Ordering::Relaxed);
        if piece >= count {
            return;
        }
        let result = work(piece);
        if let Ok(mut done) = done.lock() {
            done.push((piece, result));
        }
    };
    thread::scope(|scope| {
        for i in 0..threads.clamp(1, count.max(1)) {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build();
            let pool = pool.map_err(|error| failed(error.to_string()))?;
            thread::Builder::new()
                .name(format!("muslin-map-{i}"))
                .spawn_scoped(scope, move || pool.install(share))
                .map_err(|error| failed(error.to_string()))?;
        }
        Ok::<(), StudyError>(())
    })?;
    let mut done = done.into_inner().unwrap_or_default();
    done.sort_by_key(|(piece, _)| *piece);
    Ok(done.into_iter().map(|(_, result)| result).collect())
}

#[cfg(test)]
mod tests {
    #[test]
    fn results_come_in_order_and_threads_are_alone() {
        for threads in [1, 2, 5] {
            let work = |piece| (piece, rayon::current_num_threads());
            let results = super::each(threads, 17, work).unwrap();
            let expected: Vec<_> = (0..17).map(|piece| (piece, 1)).collect();
            assert_eq!(results, expected);
        }
    }
}
