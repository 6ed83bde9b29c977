//! Keeps the rays that a thread traces, for measuring what tracing them alone
//! takes. Only compiled with the feature `record-rays`: rendering should not
//! even ask whether somebody listens.

use std::cell::RefCell;

use super::Ray;

/// A ray, and what was asked about it.
#[derive(Clone, Copy, Debug)]
pub enum Query {
    /// [`super::Accelerator::intersect`].
    Intersect(Ray),
    /// [`super::Accelerator::occluded`].
    Occluded(Ray),
}

thread_local! {
    static QUERIES: RefCell<Option<Vec<Query>>> = const { RefCell::new(None) };
}

/// What this thread asks of any accelerator while `work` runs, in order.
pub fn recorded(work: impl FnOnce()) -> Vec<Query> {
    QUERIES.set(Some(Vec::new()));
    work();
    QUERIES.take().unwrap_or_default()
}

pub(super) fn note(query: Query) {
    QUERIES.with_borrow_mut(|queries| {
        if let Some(queries) = queries {
            queries.push(query);
        }
    });
}
