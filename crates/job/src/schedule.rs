//! Scheduler: several workers make items, and one consumer takes the results.
//!
//! ```text
//! items, in groups ──► workers, each with its own threads and state ──► results ──► consumer
//! ```
//!
//! One worker makes the items of a group one after another, so that they can share what is expensive to build. An error
//! of a single field ([`Error::is_of_one_field`]) concerns its item only. After any other error, and after a panic,
//! which becomes an error, no further item is started; items in progress are completed and delivered.

use super::Threads;
use furrow_base::supervise::supervised;
use furrow_base::{Error, Result};
use std::collections::BTreeMap;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// Order in which the consumer receives the results.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ResultOrder {
    /// As they are finished.
    AsFinished,
    /// In the order in which the items were started. Workers pause while `ahead` items are in progress or wait for the
    /// consumer, so the consumer determines the speed.
    InOrder {
        /// Largest number of items that are in progress or wait.
        ahead: usize,
    },
}

/// Items, and the results that wait for the consumer.
pub struct Schedule<I, T> {
    order: ResultOrder,
    inside: Mutex<ScheduleState<I, T>>,
    changed: Condvar,
}

/// An item with its result.
type Made<I, T> = (I, Result<T>);

struct ScheduleState<I, T> {
    /// Groups of items that no worker has taken.
    groups: Box<dyn Iterator<Item = Vec<I>> + Send>,
    /// Number of items that were started.
    started: u64,
    /// Number of items of taken groups that were not started.
    queued: usize,
    /// Whether all groups are taken.
    exhausted: bool,
    /// Started items that the consumer has not taken, by the order of their start; `None` while in progress.
    results: BTreeMap<u64, Option<Made<I, T>>>,
    /// Whether no further item may be started.
    closed: bool,
    /// Whether the consumer wants no further result.
    left: bool,
}

impl<I, T> ScheduleState<I, T> {
    /// Starts the next item of a group, or of the next group; returns `None` if there is none.
    fn next(&mut self, group: &mut std::vec::IntoIter<I>) -> Option<(u64, I)> {
        while group.len() == 0 {
            let Some(items) = self.groups.next() else {
                self.exhausted = true;
                return None;
            };
            self.queued += items.len();
            *group = items.into_iter();
        }
        let (number, item) = (self.started, group.next()?);
        self.queued -= 1;
        self.started += 1;
        self.results.insert(number, None);
        Some((number, item))
    }
}

impl<I, T> Schedule<I, T> {
    /// Creates a schedule of these groups of items.
    pub fn new(groups: impl Iterator<Item = Vec<I>> + Send + 'static, order: ResultOrder) -> Self {
        let inside = ScheduleState {
            groups: Box::new(groups),
            started: 0,
            queued: 0,
            exhausted: false,
            results: BTreeMap::new(),
            closed: false,
            left: false,
        };
        Self { order, inside: Mutex::new(inside), changed: Condvar::new() }
    }

    /// Makes all items, with one worker for each of `workers`, and runs `consume` on the calling thread meanwhile. It
    /// [takes](Self::take) the results, or waits for another thread that does; when it returns, the workers stop after
    /// their current items. No item is started once `stopped` returns `true`. `make` receives the worker's state, which
    /// is kept for the worker's next item.
    pub fn run<S: Default, R>(
        &self,
        workers: &[Threads],
        stopped: impl Fn() -> bool + Sync,
        make: impl Fn(&I, &Threads, &mut S) -> Result<T> + Sync,
        consume: impl FnOnce() -> R,
    ) -> Result<R>
    where
        I: Send,
        T: Send,
    {
        std::thread::scope(|scope| {
            // Ends the schedule even if `consume` panics; otherwise workers would wait for it forever.
            let _end = EndOnDrop(self);
            for threads in workers {
                let work = || {
                    let (mut state, mut group) = (S::default(), Vec::new().into_iter());
                    while let Some((number, item)) = self.begin(&mut group, &stopped) {
                        let made = supervised(|| make(&item, threads, &mut state)).and_then(|made| made);
                        self.finish(number, item, made);
                    }
                };
                std::thread::Builder::new()
                    .name("images".into())
                    .spawn_scoped(scope, work)
                    .map_err(Error::no_thread)?;
            }
            Ok(consume())
        })
    }

    /// Waits for room, and returns the next item of the worker's group, or of a new group, with its number. Returns
    /// `None` if no item may be started.
    fn begin(&self, group: &mut std::vec::IntoIter<I>, stopped: impl Fn() -> bool) -> Option<(u64, I)> {
        let full = |inside: &mut ScheduleState<I, T>| match self.order {
            ResultOrder::AsFinished => false,
            ResultOrder::InOrder { ahead } => !inside.closed && inside.results.len() >= ahead,
        };
        let mut inside = self.changed.wait_while(self.lock(), full).unwrap_or_else(PoisonError::into_inner);
        inside.closed |= stopped();
        let next = if inside.closed { None } else { inside.next(group) };
        self.changed.notify_all();
        next
    }

    fn finish(&self, number: u64, item: I, made: Result<T>) {
        let mut inside = self.lock();
        inside.closed |= made.as_ref().is_err_and(|e| !e.is_of_one_field());
        inside.results.insert(number, Some((item, made)));
        self.changed.notify_all();
    }

    /// Waits for the next result and returns it with its item; `None` after the last.
    pub fn take(&self) -> Option<(I, Result<T>)> {
        let ready = |inside: &ScheduleState<I, T>| {
            let mut results = inside.results.iter();
            let next = match self.order {
                ResultOrder::AsFinished => results.find(|(_, made)| made.is_some()),
                ResultOrder::InOrder { .. } => results.next().filter(|(_, made)| made.is_some()),
            };
            next.map(|(number, _)| *number)
        };
        let waits = |inside: &mut ScheduleState<I, T>| {
            let no_more = inside.closed || inside.exhausted && inside.queued == 0;
            !inside.left && ready(inside).is_none() && !(no_more && inside.results.is_empty())
        };
        let mut inside = self.changed.wait_while(self.lock(), waits).unwrap_or_else(PoisonError::into_inner);
        if inside.left {
            return None;
        }
        let next = ready(&inside).and_then(|number| inside.results.remove(&number)).flatten();
        self.changed.notify_all();
        next
    }

    /// Ends the schedule: no further item is started, and no further result is delivered.
    pub fn end(&self) {
        let mut inside = self.lock();
        (inside.closed, inside.left) = (true, true);
        self.changed.notify_all();
    }

    fn lock(&self) -> MutexGuard<'_, ScheduleState<I, T>> {
        self.inside.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Ends a schedule when it is dropped.
struct EndOnDrop<'a, I, T>(&'a Schedule<I, T>);

impl<I, T> Drop for EndOnDrop<'_, I, T> {
    fn drop(&mut self) {
        self.0.end();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use furrow_base::error::Kind;
    use furrow_base::math::ToInt;
    use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
    use std::time::{Duration, Instant};

    fn single(items: std::ops::Range<u64>, order: ResultOrder) -> Schedule<u64, u64> {
        Schedule::new(items.map(|item| vec![item]), order)
    }

    /// Rationale: a worker without work must not end the groups of the others. Expected: all items of a long group are
    /// made although the other worker finds no group after its first item.
    #[test]
    fn a_worker_without_work_leaves_the_groups_of_others() {
        for order in [ResultOrder::AsFinished, ResultOrder::InOrder { ahead: 3 }] {
            let schedule = Schedule::new([vec![0], (1..9).collect::<Vec<u64>>()].into_iter(), order);
            let workers = Threads::divided(2, 2).unwrap();
            let make = |item: &u64, _: &Threads, (): &mut ()| {
                std::thread::sleep(Duration::from_millis(if *item == 0 { 0 } else { 5 }));
                Ok(*item)
            };
            let made = schedule.run(&workers, || false, make, || all(&schedule)).unwrap();
            assert_eq!(made.len(), 9, "{order:?}");
        }
    }

    fn all(schedule: &Schedule<u64, u64>) -> Vec<Made<u64, u64>> {
        std::iter::from_fn(|| schedule.take()).collect()
    }

    fn workers(count: usize) -> Vec<Threads> {
        Threads::divided(count, count).unwrap()
    }

    /// Expected: items that take different times are delivered in order, and never more than `ahead` are in progress or
    /// wait.
    #[test]
    fn results_are_delivered_in_order_and_few_wait() {
        let schedule = single(10..40, ResultOrder::InOrder { ahead: 5 });
        let (taken, most) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let make = |item: &u64, _: &Threads, begun: &mut u64| {
            *begun += 1;
            most.fetch_max(item.to_usize() - 10 - taken.load(Ordering::SeqCst), Ordering::SeqCst);
            std::thread::sleep(Duration::from_millis(item * 7 % 5));
            Ok(2 * item)
        };
        let consume = || {
            let next = || {
                let made = schedule.take();
                taken.fetch_add(1, Ordering::SeqCst);
                made
            };
            std::iter::from_fn(next).map(|(item, made)| (item, made.unwrap())).collect::<Vec<_>>()
        };
        let found = schedule.run(&workers(3), || false, make, consume).unwrap();
        assert_eq!(found, (10..40).map(|item| (item, 2 * item)).collect::<Vec<_>>());
        // The consumer may have removed a result that it has not counted yet.
        assert!(most.into_inner() <= 5);
    }

    /// Expected: one worker makes all items of a group, in order, with its own state.
    #[test]
    fn a_group_stays_with_one_worker() {
        let groups = (0..9_u64).map(|group| (0..4).map(|k| (group, k)).collect::<Vec<_>>());
        let schedule = Schedule::<(u64, u64), u64>::new(groups, ResultOrder::AsFinished);
        let make = |item: &(u64, u64), _: &Threads, before: &mut Option<(u64, u64)>| {
            assert!(item.1 == 0 || *before == Some((item.0, item.1 - 1)));
            *before = Some(*item);
            Ok(item.0)
        };
        let count = || std::iter::from_fn(|| schedule.take()).filter(|(_, made)| made.is_ok()).count();
        assert_eq!(schedule.run(&workers(3), || false, make, count).unwrap(), 36);
    }

    /// Expected: a panic in one item is its error, what was started is delivered, nothing further is started, and the
    /// run ends, in both orders.
    #[test]
    fn a_panic_ends_the_run_with_the_items_number() {
        for order in [ResultOrder::AsFinished, ResultOrder::InOrder { ahead: 4 }] {
            let schedule = single(0..1_000_000, order);
            let make = |item: &u64, threads: &Threads, (): &mut ()| {
                assert_ne!(*item, 5, "no sun");
                std::thread::sleep(Duration::from_millis(1));
                Ok(threads.install(|| *item))
            };
            let found = schedule.run(&workers(2), || false, make, || all(&schedule)).unwrap();
            let failed: Vec<_> = found.iter().filter_map(|(item, made)| Some((*item, made.as_ref().err()?))).collect();
            let [(5, error)] = failed[..] else { panic!("{failed:?}") };
            assert!(error.message().contains("no sun") && error.kind() == Kind::Io, "{error}");
            assert!((0..5).all(|item| found.iter().any(|(k, made)| *k == item && made.is_ok())));
            // Printing the panic takes time, in which the other worker continues.
            assert!(found.len() < 100_000, "{}", found.len());
        }
    }

    /// Expected: an error of one field leaves the other items; any other error ends the run.
    #[test]
    fn an_error_of_one_field_is_its_own() {
        let fail = |error: fn() -> Error| {
            let schedule = single(0..100, ResultOrder::AsFinished);
            let make = |item: &u64, _: &Threads, (): &mut ()| if *item == 3 { Err(error()) } else { Ok(*item) };
            schedule.run(&workers(1), || false, make, || all(&schedule)).unwrap().len()
        };
        assert_eq!(fail(|| Error::input("no sun")), 100);
        assert_eq!(fail(|| Error::failed("disk full")), 4);
    }

    /// Expected: after a stop, or after the consumer has returned, the run ends soon although items are left and workers
    /// wait for room.
    #[test]
    fn a_stop_and_a_consumer_that_leaves_end_the_run() {
        let stop = AtomicBool::new(false);
        let make = |item: &u64, _: &Threads, (): &mut ()| Ok(*item);
        let begin = Instant::now();
        let schedule = single(0..u64::MAX, ResultOrder::InOrder { ahead: 4 });
        let leave = || schedule.take().map(|(item, _)| item);
        assert_eq!(schedule.run(&workers(2), || false, make, leave).unwrap(), Some(0));
        let schedule = single(0..u64::MAX, ResultOrder::AsFinished);
        let consume = || {
            schedule.take();
            stop.store(true, Ordering::SeqCst);
            all(&schedule).len()
        };
        schedule.run(&workers(2), || stop.load(Ordering::SeqCst), make, consume).unwrap();
        assert!(begin.elapsed() < Duration::from_secs(60));
    }
}
