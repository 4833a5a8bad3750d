//! The location of a dataset: a store and a place in it.

use crate::message::explained;
use object_store::aws::{AmazonS3Builder, AmazonS3ConfigKey, Checksum, S3ConditionalPut};
use object_store::azure::{AzureConfigKey, MicrosoftAzureBuilder};
use object_store::gcp::{GoogleCloudStorageBuilder, GoogleConfigKey};
use object_store::path::Path as ObjectPath;
use object_store::{BackoffConfig, ClientConfigKey, ObjectStore, RetryConfig};
use petcomp::{Error, Result};
use std::path::PathBuf;
use std::time::Duration;
use url::Url;

/// A single response may take as long as an archive of several gigabytes.
const REQUEST_TIMEOUT: &str = "15 minutes";

/// A bucket, and a prefix in it.
pub(crate) struct Location {
    /// As given, without a trailing slash.
    pub(crate) url: String,
    scheme: Scheme,
    bucket: String,
    prefix: ObjectPath,
}

#[derive(Clone, Copy)]
enum Scheme {
    S3,
    GoogleCloud,
    Azure,
}

impl Location {
    /// Reads `s3://BUCKET/PREFIX`, `gs://..` or `az://..`.
    ///
    /// # Errors
    /// [`Error::Value`] for anything else, for a URL with a user, a query or a fragment (it is not
    /// shown: it may contain credentials), and for a prefix that no object may have.
    pub(crate) fn parse(text: &str) -> Result<Self> {
        let url = Url::parse(text).map_err(|e| unusable(text, &e))?;
        refuse_credentials(&url)?;
        let bucket = url.host_str().unwrap_or_default();
        check_bucket(bucket)
            .map_err(|what| Error::value("output", format!("\"{text}\", {what}")))?;
        let prefix = ObjectPath::from_url_path(url.path());
        Ok(Self {
            url: text.trim_end_matches('/').to_owned(),
            scheme: scheme_of(&url)?,
            bucket: bucket.to_owned(),
            prefix: prefix.map_err(|e| unusable(text, &e))?,
        })
    }

    pub(crate) fn path_of(&self, name: &str) -> ObjectPath {
        let parts = name.split('/').map(|part| part.to_owned().into());
        self.prefix.parts().chain(parts).collect()
    }

    /// An object's name in messages.
    pub(crate) fn url_of(&self, at: &ObjectPath) -> PathBuf {
        let (scheme, _) = self.url.split_once("://").unwrap_or_default();
        PathBuf::from(format!("{scheme}://{}/{at}", self.bucket))
    }

    /// Connects to the store with the environment's settings.
    pub(crate) fn connect(&self) -> Result<Box<dyn ObjectStore>> {
        use_ring();
        let store = match self.scheme {
            Scheme::S3 => self.s3(),
            Scheme::GoogleCloud => self.google_cloud(),
            Scheme::Azure => self.azure(),
        };
        store.map_err(|e| unusable(&self.url, &explained(&e)))
    }

    fn s3(&self) -> object_store::Result<Box<dyn ObjectStore>> {
        let client = AmazonS3ConfigKey::Client(ClientConfigKey::Timeout);
        let store = AmazonS3Builder::from_env()
            .with_bucket_name(&self.bucket)
            .with_config(client, REQUEST_TIMEOUT)
            .with_checksum_algorithm(Checksum::SHA256)
            .with_conditional_put(S3ConditionalPut::ETagMatch)
            .with_retry(retries());
        Ok(Box::new(store.build()?))
    }

    fn google_cloud(&self) -> object_store::Result<Box<dyn ObjectStore>> {
        let client = GoogleConfigKey::Client(ClientConfigKey::Timeout);
        let store = GoogleCloudStorageBuilder::from_env()
            .with_bucket_name(&self.bucket)
            .with_config(client, REQUEST_TIMEOUT)
            .with_retry(retries());
        Ok(Box::new(store.build()?))
    }

    fn azure(&self) -> object_store::Result<Box<dyn ObjectStore>> {
        let client = AzureConfigKey::Client(ClientConfigKey::Timeout);
        let store = MicrosoftAzureBuilder::from_env()
            .with_container_name(&self.bucket)
            .with_config(client, REQUEST_TIMEOUT)
            .with_retry(retries());
        Ok(Box::new(store.build()?))
    }
}

fn unusable(url: &str, why: &dyn std::fmt::Display) -> Error {
    Error::value("output", format!("\"{url}\": {why}"))
}

/// Fails unless a URL is that of an object store.
///
/// # Errors
/// As [`open`](crate::open), except for settings in the environment.
pub fn check(url: &str) -> Result<()> {
    Location::parse(url).map(|_| ())
}

/// The folder of a `file://` URL.
///
/// # Errors
/// [`Error::Value`] for any other URL, for one that names another machine, and for one with a query
/// or a fragment, which are not part of a path.
pub fn folder_of(url: &str) -> Result<PathBuf> {
    let refused = |expected| Error::value("output", format!("\"{url}\", expected {expected}"));
    let parsed = Url::parse(url).map_err(|_| refused("file:///FOLDER"))?;
    if parsed.query().is_some() || parsed.fragment().is_some() {
        return Err(refused("%23 for # and %3F for ?"));
    }
    let path = parsed.to_file_path();
    path.map_err(|()| refused("file:///FOLDER"))
}

fn scheme_of(url: &Url) -> Result<Scheme> {
    match url.scheme() {
        "s3" => Ok(Scheme::S3),
        "gs" => Ok(Scheme::GoogleCloud),
        "az" => Ok(Scheme::Azure),
        other => Err(Error::value(
            "output",
            format!("{other}://, expected a folder, file://, s3://, gs:// or az://"),
        )),
    }
}

/// A percent sign encodes a character that no store allows in the name of a bucket.
fn check_bucket(bucket: &str) -> std::result::Result<(), &'static str> {
    match bucket {
        "" => Err("expected a bucket after the ://"),
        _ if bucket.contains('%') => Err("expected a bucket of ASCII letters, digits, - and ."),
        _ => Ok(()),
    }
}

fn refuse_credentials(url: &Url) -> Result<()> {
    let is_bare = url.username().is_empty() && url.password().is_none();
    if is_bare && url.query().is_none() && url.fragment().is_none() && url.port().is_none() {
        return Ok(());
    }
    let what = "a URL with more than a bucket and a prefix, expected credentials and endpoints only in the \
        environment (AWS_ACCESS_KEY_ID, AWS_ENDPOINT_URL, ..)";
    Err(Error::value("output", what))
}

/// Six further attempts within a minute, with doubled pauses.
fn retries() -> RetryConfig {
    RetryConfig {
        backoff: BackoffConfig {
            init_backoff: Duration::from_millis(200),
            max_backoff: Duration::from_secs(10),
            base: 2.0,
        },
        max_retries: 6,
        retry_timeout: Duration::from_secs(60),
    }
}

/// TLS for the whole process, unless it has already chosen a provider.
fn use_ring() {
    // An error means that another one was already chosen, which is fine.
    let _ = rustls::crypto::ring::default_provider().install_default();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_object_is_named_as_it_was_asked_for() {
        let location = Location::parse("s3://bucket/some/prefix/").unwrap();
        assert_eq!(location.url, "s3://bucket/some/prefix");
        let at = location.path_of("webdataset/train-000000.tar");
        assert_eq!(at.as_ref(), "some/prefix/webdataset/train-000000.tar");
        let url = location.url_of(&at);
        assert_eq!(
            url.to_str(),
            Some("s3://bucket/some/prefix/webdataset/train-000000.tar")
        );
        let bare = Location::parse("gs://bucket").unwrap();
        assert_eq!(bare.path_of("a").as_ref(), "a");
    }

    #[test]
    fn credentials_in_a_url_are_refused_and_not_shown() {
        for url in [
            "s3://AKIA:hush@bucket/a",
            "s3://AKIA@bucket/a",
            "az://container/a?sig=hush",
            "s3://bucket/a#hush",
            "s3://bucket:443/a",
        ] {
            let e = Location::parse(url).err().unwrap().to_string();
            assert!(
                e.starts_with("output: a URL with more than a bucket"),
                "{e}"
            );
            assert!(!e.contains("hush") && !e.contains("AKIA"), "{e}");
        }
    }

    #[test]
    fn a_folder_may_be_a_url() {
        assert_eq!(
            folder_of("file:///a/b%20c").unwrap(),
            PathBuf::from("/a/b c")
        );
        assert_eq!(folder_of("FILE:/a%23b").unwrap(), PathBuf::from("/a#b"));
        assert!(folder_of("file://elsewhere/a").is_err());
    }

    #[test]
    fn a_query_or_a_fragment_is_no_part_of_a_folder() {
        for url in ["file:///a/b#c", "file:///a/b?c"] {
            let expected = format!("output: \"{url}\", expected %23 for # and %3F for ?");
            assert_eq!(folder_of(url).unwrap_err().to_string(), expected);
        }
    }

    #[test]
    fn other_urls_are_named() {
        for (url, expected) in [
            (
                "ftp://host/a",
                "output: ftp://, expected a folder, file://, s3://, gs:// or az://",
            ),
            (
                "s3:///a",
                "output: \"s3:///a\", expected a bucket after the ://",
            ),
            (
                "s3://bücket/a",
                "output: \"s3://bücket/a\", expected a bucket of ASCII letters, digits, - and .",
            ),
        ] {
            assert_eq!(Location::parse(url).err().unwrap().to_string(), expected);
        }
    }
}
