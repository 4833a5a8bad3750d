//! Heavy work: outside the threads that answer, and cancelled if a newer request of the same tab
//! replaces it.

use crate::refusal::{Answer, Refusal};
use axum::extract::FromRequestParts;
use axum::http::StatusCode;
use axum::http::request::Parts;
use std::collections::HashMap;
use std::convert::Infallible;
use std::sync::{Arc, Mutex, PoisonError};

/// The header with the name of a tab.
const TAB_HEADER: &str = "x-tab";

/// Runs heavy work on a thread where it blocks no other request.
pub(crate) async fn blocking<T: Send + 'static>(
    work: impl FnOnce() -> Answer<T> + Send + 'static,
) -> Answer<T> {
    let outcome = tokio::task::spawn_blocking(work).await;
    outcome.unwrap_or_else(|_| Err(broken()))
}

fn broken() -> Refusal {
    let what = "petcomp failed; see its message in the terminal";
    Refusal::new(StatusCode::INTERNAL_SERVER_ERROR, what)
}

/// The browser tab of a request. A request without the header replaces nothing and is never
/// replaced.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) struct Tab(Option<String>);

impl Tab {
    /// A part of the tab, whose requests replace each other but none of another part.
    pub(crate) fn part(&self, name: &str) -> Self {
        Self(self.0.as_ref().map(|tab| format!("{tab}/{name}")))
    }
}

impl<S: Sync> FromRequestParts<S> for Tab {
    type Rejection = Infallible;

    async fn from_request_parts(parts: &mut Parts, _: &S) -> Result<Self, Infallible> {
        let name = parts.headers.get(TAB_HEADER);
        let name = name.and_then(|value| value.to_str().ok());
        Ok(Self(name.map(str::to_owned)))
    }
}

/// Requests of which only the newest of each tab matters: from a moving slider, or a dragged
/// corner.
#[derive(Clone, Default)]
pub(crate) struct Turns(Arc<Mutex<HashMap<Tab, u64>>>);

/// The turn of one request.
#[derive(Clone)]
pub(crate) struct Turn {
    turns: Turns,
    tab: Tab,
    number: u64,
}

impl Turns {
    /// Runs heavy work, unless a newer request of the tab arrives before it begins. Long work calls
    /// [`Turn::check`] now and then.
    pub(crate) async fn run<T: Send + 'static>(
        &self,
        tab: Tab,
        work: impl FnOnce(&Turn) -> Answer<T> + Send + 'static,
    ) -> Answer<T> {
        let turn = self.take(tab);
        blocking(move || {
            turn.check()?;
            work(&turn)
        })
        .await
    }

    fn take(&self, tab: Tab) -> Turn {
        let mut newest = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let number = newest.entry(tab.clone()).or_default();
        *number += 1;
        Turn {
            turns: self.clone(),
            number: *number,
            tab,
        }
    }
}

impl Turn {
    /// # Errors
    /// [`Refusal::superseded`] if the tab has sent a newer request.
    pub(crate) fn check(&self) -> Answer<()> {
        let newest = self.turns.0.lock().unwrap_or_else(PoisonError::into_inner);
        match newest.get(&self.tab) {
            Some(&number) if number == self.number || self.tab.0.is_none() => Ok(()),
            _ => Err(Refusal::superseded()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_newer_request_ends_older_ones_of_its_tab_alone() {
        let turns = Turns::default();
        let (here, there) = (Tab(Some("a".into())), Tab(Some("b".into())));
        let (old, other) = (turns.take(here.clone()), turns.take(there));
        assert!(old.check().is_ok());
        let new = turns.take(here);
        assert!(old.check().is_err() && new.check().is_ok() && other.check().is_ok());
        let nameless = [turns.take(Tab(None)), turns.take(Tab(None))];
        assert!(nameless.iter().all(|turn| turn.check().is_ok()));
    }
}
