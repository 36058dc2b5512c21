//! Work that no other work may interrupt.

use rayon::ThreadPoolBuilder;
use std::panic::resume_unwind;
use std::thread;

/// Runs `work` on a thread of its own, and what it does in parallel on that thread alone.
///
/// For what is made under a lock on the first use. A thread of the pool that waited there for the parallel parts of its work would meanwhile
/// take up another task, which may need the same lock; and parts that are left to the pool would never run once all its threads wait for the lock.
pub(crate) fn alone<R: Send>(work: impl FnOnce() -> R + Send) -> R {
    let lonely = || {
        // Without a pool of its own, it would use the global one; only a system without threads gives none.
        let pool = ThreadPoolBuilder::new().num_threads(1).use_current_thread().build();
        let result = work();
        drop(pool);
        result
    };
    thread::scope(|scope| scope.spawn(lonely).join()).unwrap_or_else(|panic| resume_unwind(panic))
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;
    use std::sync::OnceLock;

    #[test]
    fn all_tasks_of_the_pool_may_need_the_same_first_use() {
        let pool = ThreadPoolBuilder::new().num_threads(2).build().unwrap();
        for _ in 0..20 {
            let cells: Vec<OnceLock<u64>> = (0..4).map(|_| OnceLock::new()).collect();
            let make = || alone(|| (0..20_000_u64).into_par_iter().map(|i| i % 7).sum());
            let sums: Vec<u64> = pool.install(|| {
                let tasks = (0..64).into_par_iter().with_max_len(1);
                tasks.map(|i| *cells[i % 4].get_or_init(make)).collect()
            });
            assert!(sums.iter().all(|&sum| sum == sums[0]));
        }
    }

    #[test]
    fn what_runs_alone_sees_one_thread() {
        assert_eq!(alone(rayon::current_num_threads), 1);
    }
}
