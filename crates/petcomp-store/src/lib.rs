//! Datasets in object stores: Amazon S3 and compatible ones, Google Cloud Storage, Azure Blob
//! Storage.
//!
//! Credentials and endpoints come from the environment, under the names that the stores' own tools
//! use (`AWS_ACCESS_KEY_ID`, `AWS_ENDPOINT_URL`, `GOOGLE_SERVICE_ACCOUNT`,
//! `AZURE_STORAGE_ACCOUNT_NAME`, ..), and on cloud machines from the machine's own role. They never
//! appear in messages.

mod location;
mod message;

pub use location::{check, folder_of};

use futures_util::TryStreamExt;
use location::Location;
use message::explained;
use object_store::path::Path as ObjectPath;
use object_store::{Error as StoreError, ObjectStore, ObjectStoreExt, PutMode, PutPayload};
use petcomp::dataset::ArchiveStore;
use petcomp::{Error, Result};
use std::sync::Arc;
use std::time::Duration;
use tokio::runtime::Runtime;

/// Total attempts of a put, each with the client's own retries.
const PUT_ATTEMPTS: u32 = 3;

/// Before the second attempt; doubled before each further one.
const FIRST_PAUSE: Duration = Duration::from_secs(1);

/// Opens the store behind a URL: `s3://BUCKET/PREFIX`, `gs://BUCKET/PREFIX` or
/// `az://CONTAINER/PREFIX`.
///
/// Sends no request yet.
///
/// # Errors
/// [`Error::Value`] for a URL that is none of these or that contains credentials, and for
/// inconsistent settings in the environment.
pub fn open(url: &str) -> Result<Arc<dyn ArchiveStore>> {
    let location = Location::parse(url)?;
    let store = location.connect()?;
    Ok(Arc::new(Prefix::new(location, store)?))
}

/// The objects below a prefix of a store.
struct Prefix {
    location: Location,
    store: Box<dyn ObjectStore>,
    runtime: Runtime,
}

impl Prefix {
    fn new(location: Location, store: Box<dyn ObjectStore>) -> Result<Self> {
        let runtime = tokio::runtime::Builder::new_current_thread()
            .enable_all()
            .build();
        let runtime = runtime.map_err(|e| Error::value("output", e))?;
        Ok(Self {
            location,
            store,
            runtime,
        })
    }

    /// Puts content, and tries again if the outcome is unknown.
    async fn put_again(&self, at: &ObjectPath, content: PutPayload) -> object_store::Result<()> {
        let mut pause = FIRST_PAUSE;
        for _ in 1..PUT_ATTEMPTS {
            match self.put_once(at, content.clone()).await {
                Err(StoreError::Generic { .. }) => tokio::time::sleep(pause).await,
                answer => return answer,
            }
            pause *= 2;
        }
        self.put_once(at, content).await
    }

    async fn put_once(&self, at: &ObjectPath, content: PutPayload) -> object_store::Result<()> {
        let put = self.store.put_opts(at, content, PutMode::Create.into());
        put.await.map(|_| ())
    }

    fn error(&self, at: &ObjectPath, error: &StoreError) -> Error {
        Error::file(self.location.url_of(at), explained(error))
    }
}

impl ArchiveStore for Prefix {
    fn url(&self) -> &str {
        &self.location.url
    }

    fn put(&self, name: &str, content: Vec<u8>) -> Result<bool> {
        let at = self.location.path_of(name);
        match self.runtime.block_on(self.put_again(&at, content.into())) {
            Ok(()) => Ok(true),
            Err(StoreError::AlreadyExists { .. }) => Ok(false),
            Err(error) => Err(self.error(&at, &error)),
        }
    }

    fn get(&self, name: &str) -> Result<Vec<u8>> {
        let at = self.location.path_of(name);
        let got = self
            .runtime
            .block_on(async { self.store.get(&at).await?.bytes().await });
        got.map(Vec::from).map_err(|error| self.error(&at, &error))
    }

    fn names(&self, folder: &str) -> Result<Vec<String>> {
        let below = self.location.path_of(folder);
        let list = self.store.list(Some(&below));
        let list = list.map_ok(|object| object.location.filename().unwrap_or_default().to_owned());
        let names = self.runtime.block_on(list.try_collect());
        names.map_err(|error| self.error(&below, &error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use object_store::memory::InMemory;

    fn prefix() -> Prefix {
        let location = Location::parse("s3://bucket/a/b/").unwrap();
        Prefix::new(location, Box::new(InMemory::new())).unwrap()
    }

    #[test]
    fn what_is_there_stays() {
        let store = prefix();
        assert!(store.put("x/000001.json", b"one".into()).unwrap());
        assert!(!store.put("x/000001.json", b"two".into()).unwrap());
        assert_eq!(store.get("x/000001.json").unwrap(), b"one");
    }

    #[test]
    fn names_are_those_below_the_folder() {
        let store = prefix();
        for name in ["x/1.json", "x/2.json", "xy/3.json", "4.json"] {
            store.put(name, Vec::new()).unwrap();
        }
        let mut names = store.names("x").unwrap();
        names.sort();
        assert_eq!(names, ["1.json", "2.json"]);
        assert!(store.names("none").unwrap().is_empty());
    }

    #[test]
    fn a_missing_object_is_named() {
        let e = prefix().get("x/1.json").unwrap_err().to_string();
        assert!(e.starts_with("s3://bucket/a/b/x/1.json: "), "{e}");
    }
}
