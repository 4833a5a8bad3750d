//! What strangers try: other sites' pages, other names for this machine, paths that lead out, bodies
//! without an end, connections without number, names that are markup.

mod browser;

use browser::Browser;
use browser::studio::Studio;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

fn folder_with(files: &[(&str, &str)]) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("inside")).unwrap();
    for (name, text) in files {
        std::fs::write(dir.path().join(name), text).unwrap();
    }
    dir
}

fn studio_of(dir: &tempfile::TempDir) -> Studio {
    Studio::over(&dir.path().join("inside"))
}

fn status(answer: &str) -> &str {
    answer.split(' ').nth(1).unwrap_or("none")
}

#[test]
fn nobody_is_answered_without_the_token() {
    let dir = folder_with(&[]);
    let studio = studio_of(&dir);
    assert_eq!(status(&studio.get("")), "200");
    let host = studio.host();
    let wrong = "0".repeat(32);
    for path in [
        "/",
        "/api/overview",
        "/studio.js",
        &format!("/{wrong}/"),
        "//",
    ] {
        let answer = studio.send(
            format!("GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n").as_bytes(),
        );
        assert_eq!(status(&answer), "403", "{path}: {answer}");
        assert!(
            !answer.contains(studio.root().trim_matches('/')),
            "{answer}"
        );
    }
}

#[test]
fn other_sites_and_other_names_for_this_machine_are_refused() {
    let dir = folder_with(&[]);
    let studio = studio_of(&dir);
    let (host, root) = (studio.host(), studio.root());
    let port = host.rsplit(':').next().unwrap();
    let ask = |method: &str, host: &str, rest: &str| {
        let request = format!(
            "{method} {root}api/overview HTTP/1.1\r\nHost: {host}\r\n{rest}Connection: close\r\n\r\n"
        );
        status(&studio.send(request.as_bytes())).to_owned()
    };
    assert_eq!(ask("GET", host, ""), "200");
    assert_eq!(ask("GET", &format!("localhost:{port}"), ""), "200");
    for name in [
        "evil.example",
        "127.0.0.1",
        "evil.example:80",
        "[::1]:80",
        "",
    ] {
        assert_eq!(ask("GET", name, ""), "403", "{name}");
    }
    let foreign = [
        "Origin: http://evil.example\r\n".to_owned(),
        format!("Origin: https://{host}\r\n"),
        "Origin: null\r\n".into(),
        "Origin: http://127.0.0.1:1\r\n".into(),
        "Sec-Fetch-Site: cross-site\r\nSec-Fetch-Mode: no-cors\r\n".into(),
        "Sec-Fetch-Site: same-site\r\nSec-Fetch-Mode: cors\r\n".into(),
    ];
    for header in &foreign {
        assert_eq!(ask("GET", host, header), "403", "{header}");
    }
    let link = "Sec-Fetch-Site: cross-site\r\nSec-Fetch-Mode: navigate\r\n";
    assert_eq!(ask("GET", host, link), "200", "a link may lead here");
    assert_eq!(ask("POST", host, link), "403", "a form may not");
}

#[test]
fn every_answer_forbids_to_load_or_frame_anything() {
    let dir = folder_with(&[]);
    let studio = studio_of(&dir);
    for path in ["", "studio.js", "api/overview", "nothing"] {
        let answer = studio.get(path).to_lowercase();
        for header in [
            "content-security-policy: default-src 'none'; script-src 'self'",
            "frame-ancestors 'none'",
            "x-content-type-options: nosniff",
            "referrer-policy: no-referrer",
        ] {
            assert!(answer.contains(header), "{path}: {answer}");
        }
        assert!(!answer.contains("access-control-allow"), "{answer}");
    }
}

#[test]
fn paths_that_lead_out_are_not_found() {
    let dir = folder_with(&[("secret.jpg", "secret")]);
    let inside = dir.path().join("inside");
    std::os::unix::fs::symlink(dir.path().join("secret.jpg"), inside.join("far.jpg")).unwrap();
    std::os::unix::fs::symlink(dir.path(), inside.join("up")).unwrap();
    let studio = studio_of(&dir);
    for name in [
        "../secret.jpg",
        "..%2fsecret.jpg",
        "%2e%2e%2fsecret.jpg",
        "..%5csecret.jpg",
        "/etc/passwd",
        "%2fetc%2fpasswd",
        "far.jpg",
        "up/secret.jpg",
        "inside/../../secret.jpg",
        "secret.jpg%00.png",
        "",
        ".",
    ] {
        let answer = studio.get(&format!("api/photo?file={name}"));
        assert_eq!(status(&answer), "404", "{name}: {answer}");
        assert!(!answer.contains("\r\n\r\nsecret"), "{answer}");
    }
    for path in [
        "../../etc/passwd",
        "%2e%2e/%2e%2e/etc/passwd",
        "..%2f..%2fetc%2fpasswd",
    ] {
        let answer = studio.get(path);
        assert!(matches!(status(&answer), "403" | "404"), "{path}: {answer}");
    }
}

#[test]
fn a_body_of_a_hundred_megabytes_is_refused() {
    let dir = folder_with(&[]);
    let studio = studio_of(&dir);
    let body = format!("{{\"file\": \"{}\"}}", "a".repeat(100 << 20));
    let start = Instant::now();
    let answer = studio.post("api/corners/solve", &body);
    assert!(
        matches!(status(&answer), "413" | "none"),
        "{}",
        &answer[..answer.len().min(300)]
    );
    assert!(start.elapsed() < Duration::from_secs(30));
    assert_eq!(
        status(&studio.get("")),
        "200",
        "and the next one is answered"
    );
}

#[test]
fn requests_of_a_wrong_method_or_length_are_refused_in_json() {
    let dir = folder_with(&[]);
    let studio = studio_of(&dir);
    let (root, host) = (studio.root(), studio.host());
    let request =
        format!("PUT {root}api/overview HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
    let wrong_method = studio.send(request.as_bytes());
    // One byte more than is read.
    let too_long = studio.post("api/corners/solve", &"a".repeat((16 << 20) + 1));
    for (answer, expected) in [(wrong_method, "405"), (too_long, "413")] {
        assert_eq!(status(&answer), expected, "{answer}");
        assert!(answer.contains("\r\n\r\n{\"error\":\""), "{answer}");
    }
}

#[test]
fn a_body_that_does_not_come_is_not_waited_for() {
    let dir = folder_with(&[]);
    let studio = studio_of(&dir);
    let (root, host) = (studio.root(), studio.host());
    let request = format!(
        "POST {root}api/recipe/new HTTP/1.1\r\nHost: {host}\r\nOrigin: http://{host}\r\n\
         Content-Type: application/json\r\nContent-Length: 1000\r\n\r\n{{"
    );
    assert_eq!(status(&studio.send(request.as_bytes())), "408");
}

#[test]
fn more_silent_connections_than_are_answered_do_not_stop_the_studio() {
    let dir = folder_with(&[]);
    let studio = studio_of(&dir);
    let start = Instant::now();
    // More than are answered at a time (256), and few enough for 1024 open files.
    let silent: Vec<TcpStream> = (0..400)
        .filter_map(|_| {
            TcpStream::connect_timeout(&studio.host().parse().unwrap(), Duration::from_secs(2)).ok()
        })
        .collect();
    assert!(silent.len() > 256, "{}", silent.len());
    let mut stream = TcpStream::connect(studio.host()).unwrap();
    stream
        .set_read_timeout(Some(Duration::from_secs(60)))
        .unwrap();
    let (root, host) = (studio.root(), studio.host());
    let request = format!("GET {root} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    assert_eq!(status(&answer), "200");
    println!(
        "{} silent connections and an answer in {:.1} s",
        silent.len(),
        start.elapsed().as_secs_f64()
    );
}

#[test]
fn nonsense_is_answered_or_hung_up_on() {
    let dir = folder_with(&[]);
    let studio = studio_of(&dir);
    let long = format!("GET /{} HTTP/1.1\r\n\r\n", "a".repeat(1 << 20));
    for bytes in [
        &b"\0\0\0\0\r\n\r\n"[..],
        b"GET\r\n\r\n",
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
        long.as_bytes(),
    ] {
        let answer = studio.send(bytes);
        assert!(!answer.contains(" 200 "), "{answer}");
    }
    for body in [
        "",
        "{",
        "[]",
        "null",
        "{\"label\": 3}",
        &"[".repeat(100_000),
    ] {
        let answer = studio.post("api/corners/solve", body);
        assert!(status(&answer).starts_with('4'), "{answer}");
    }
    assert_eq!(status(&studio.get("")), "200");
}

/// Markup that would run if a name became markup.
const EVIL_NAME: &str = "<img src=x onerror=document.title='evil'>.jpg";

#[test]
fn a_name_with_markup_in_it_is_shown_as_it_is() {
    let dir = tempfile::tempdir().unwrap();
    let photo = browser::studio::samples("backgrounds/bg0000.jpg");
    std::fs::copy(photo, dir.path().join(EVIL_NAME)).unwrap();
    let Some(mut browser) = Browser::open(1200, 800) else {
        return;
    };
    let studio = Studio::over(dir.path());
    browser.go(&studio.page("corners"));
    browser.wait("document.querySelectorAll('.list li').length === 1");
    assert!(browser.text(".list li .name").contains("<img"));
    assert_ne!(browser.eval("document.title"), "evil");
    browser.assert_content();
}

#[test]
fn another_sites_page_reads_nothing_even_if_it_knows_the_token() {
    let Some(mut browser) = Browser::open(800, 600) else {
        return;
    };
    let dir = tempfile::tempdir().unwrap();
    let photo = browser::studio::samples("backgrounds/bg0000.jpg");
    std::fs::copy(photo, dir.path().join("a.jpg")).unwrap();
    let studio = Studio::over(dir.path());
    let (page, picture) = (
        studio.page("api/overview"),
        studio.page("api/photo?file=a.jpg"),
    );
    assert_eq!(status(&studio.get("api/photo?file=a.jpg")), "200");
    // The page about:blank is of no site.
    let read = format!("fetch('{page}').then((r) => r.ok, () => false)");
    assert_eq!(browser.eval(&read), false);
    let posted = format!(
        "fetch('{page}', {{method: 'POST', mode: 'no-cors'}}).then((r) => r.ok, () => false)"
    );
    assert_eq!(browser.eval(&posted), false);
    for element in ["img", "script", "iframe"] {
        let load = format!(
            "new Promise((done) => {{ const e = document.createElement('{element}'); e.onload = () => done('{element}' !== 'iframe'); \
             e.onerror = () => done(false); e.src = '{picture}'; document.body.append(e); }})"
        );
        assert_eq!(browser.eval(&load), false, "{element}");
    }
    let framed = "(() => { try { return document.querySelector('iframe').contentDocument?.images.length ?? 0 } catch { return 0 } })()";
    assert_eq!(browser.eval(framed), 0);
}
