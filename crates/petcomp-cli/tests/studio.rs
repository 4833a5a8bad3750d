//! `petcomp studio`: an address is printed, answers, and is gone after Ctrl-C.
#![cfg(feature = "studio")]

mod hearing;

use hearing::hearing;
use rustix::process::{Pid, Signal, kill_process};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::process::{Command, Stdio};
use std::time::Duration;

/// The status line of the answer to a GET.
fn status(address: &str) -> String {
    let rest = address.strip_prefix("http://").unwrap();
    let (host, path) = rest.split_once('/').unwrap();
    let mut stream = TcpStream::connect(host).unwrap();
    let request = format!("GET /{path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n");
    stream.write_all(request.as_bytes()).unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).unwrap();
    answer.lines().next().unwrap().to_owned()
}

#[test]
fn the_studio_answers_at_its_address_until_it_is_interrupted() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = Command::new(env!("CARGO_BIN_EXE_petcomp"));
    command.arg("studio").arg(folder.path());
    let mut studio = hearing(&command).stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(studio.stdout.take().unwrap()).lines();
    let address = lines.next().unwrap().unwrap();
    assert_eq!(status(&address), "HTTP/1.1 200 OK");
    assert_eq!(
        status(&address[..address.len() - 2]),
        "HTTP/1.1 403 Forbidden"
    );
    kill_process(Pid::from_child(&studio), Signal::INT).unwrap();
    assert!(studio.wait().unwrap().success());
}

#[test]
fn a_studio_that_was_started_to_ignore_hang_ups_outlives_them() {
    let folder = tempfile::tempdir().unwrap();
    let mut studio = Command::new("sh")
        .args(["-c", "trap '' HUP; exec \"$0\" studio \"$1\""])
        .arg(env!("CARGO_BIN_EXE_petcomp"))
        .arg(folder.path())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(studio.stdout.take().unwrap()).lines();
    let address = lines.next().unwrap().unwrap();
    let id = Pid::from_child(&studio);
    // It is printed before signals are caught, and answers after that.
    assert_eq!(status(&address), "HTTP/1.1 200 OK");
    kill_process(id, Signal::HUP).unwrap();
    std::thread::sleep(Duration::from_millis(500));
    assert_eq!(studio.try_wait().unwrap(), None);
    kill_process(id, Signal::TERM).unwrap();
    assert!(studio.wait().unwrap().success());
}

#[test]
fn a_folder_that_is_not_there_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_petcomp"))
        .args(["studio", "nowhere"])
        .current_dir(folder.path())
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(said.trim(), "error: nowhere: no such folder");
    assert_eq!(output.status.code(), Some(4));
}
