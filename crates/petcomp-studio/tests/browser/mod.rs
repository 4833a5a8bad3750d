//! A real browser for tests: Chromium without a window, driven by the DevTools protocol.
//!
//! Where no Chromium is installed, [`Browser::open`] says so and gives none, and the test passes.
#![allow(dead_code, reason = "each test uses a part")]

pub(crate) mod studio;
pub(crate) mod tray;

use serde_json::{Value, json};
use std::io::{BufRead, BufReader, ErrorKind, Write as _};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tungstenite::{Message, WebSocket};

const PROGRAMS: [&str; 4] = ["chromium", "chromium-browser", "google-chrome", "chrome"];
/// How long a page may take for what a test waits for.
const PATIENCE: Duration = Duration::from_secs(60);
const PAUSE: Duration = Duration::from_millis(25);

/// A page of a browser of its own. Its methods panic where the browser does not do what is asked.
pub(crate) struct Browser {
    process: Child,
    _profile: tempfile::TempDir,
    socket: WebSocket<TcpStream>,
    session: String,
    calls: u64,
    /// Everything that the page complained of: exceptions, refused loads, errors on the console.
    pub(crate) complaints: Vec<String>,
}

/// Keys that are held while others are pressed, as the protocol counts them.
pub(crate) const ALT: u64 = 1;
pub(crate) const CTRL: u64 = 2;
pub(crate) const SHIFT: u64 = 8;

impl Browser {
    /// A browser with a page of so many pixels; none where Chromium is not installed.
    pub(crate) fn open(width: u32, height: u32) -> Option<Self> {
        let profile = tempfile::tempdir().unwrap();
        let Some(mut process) = start(profile.path()) else {
            let _ = writeln!(
                std::io::stderr(),
                "skipped: chromium is not installed: nothing is tested in a browser"
            );
            return None;
        };
        let address = devtools_address(&mut process);
        let mut browser = Self {
            process,
            _profile: profile,
            socket: connect(&address),
            session: String::new(),
            calls: 0,
            complaints: Vec::new(),
        };
        browser.attach();
        browser.resize(width, height);
        Some(browser)
    }

    fn attach(&mut self) {
        let target = self.call("Target.createTarget", json!({ "url": "about:blank" }));
        let target = target["targetId"].clone();
        let attached = json!({ "targetId": target, "flatten": true });
        let attached = self.call("Target.attachToTarget", attached);
        self.session = attached["sessionId"].as_str().unwrap().into();
        for domain in ["Page", "Runtime", "Log"] {
            self.call(&format!("{domain}.enable"), json!({}));
        }
    }

    /// The page's size in CSS pixels.
    pub(crate) fn resize(&mut self, width: u32, height: u32) {
        let size = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600 });
        self.call("Emulation.setDeviceMetricsOverride", size);
    }

    /// Shows pages as to a person who likes them dark, or light.
    pub(crate) fn prefer_dark(&mut self, dark: bool) {
        let value = if dark { "dark" } else { "light" };
        let feature = json!({ "name": "prefers-color-scheme", "value": value });
        self.call(
            "Emulation.setEmulatedMedia",
            json!({ "features": [feature] }),
        );
    }

    /// Opens an address, and waits until its scripts have begun.
    pub(crate) fn go(&mut self, address: &str) {
        let gone = self.call("Page.navigate", json!({ "url": address }));
        assert!(gone.get("errorText").is_none(), "{address}: {gone}");
        let here = json!(address.split('?').next());
        let loaded =
            format!("document.readyState === 'complete' && location.href.startsWith({here})");
        self.wait(&loaded);
    }

    /// What a script gives; a promise is awaited.
    pub(crate) fn eval(&mut self, script: &str) -> Value {
        let asked = json!({ "expression": script, "awaitPromise": true, "returnByValue": true });
        let answer = self.call("Runtime.evaluate", asked);
        assert!(
            answer.get("exceptionDetails").is_none(),
            "{script}: {answer}"
        );
        answer["result"]["value"].clone()
    }

    /// The text that is shown in the first element of a CSS selector.
    pub(crate) fn text(&mut self, selector: &str) -> String {
        let script = format!(
            "document.querySelector({})?.innerText ?? ''",
            json!(selector)
        );
        self.eval(&script).as_str().unwrap_or_default().into()
    }

    /// Waits until a script gives something true.
    pub(crate) fn wait(&mut self, script: &str) {
        let start = Instant::now();
        while !is_true(&self.eval(script)) {
            let news = "document.querySelector('footer')?.innerText";
            assert!(
                start.elapsed() < PATIENCE,
                "waited in vain for {script}; the page says {}, and complains of {:?}",
                self.eval(news),
                self.complaints
            );
            std::thread::sleep(PAUSE);
        }
    }

    /// Waits until an element is there.
    pub(crate) fn wait_for(&mut self, selector: &str) {
        self.wait(&format!("!!document.querySelector({})", json!(selector)));
    }

    /// Clicks at a place of the page, CSS pixels.
    pub(crate) fn click(&mut self, [x, y]: [f64; 2]) {
        self.mouse("mouseMoved", [x, y], "none");
        self.mouse("mousePressed", [x, y], "left");
        self.mouse("mouseReleased", [x, y], "left");
    }

    /// Moves the pointer with the button held.
    pub(crate) fn drag(&mut self, path: &[[f64; 2]]) {
        let (first, last) = (path[0], path[path.len() - 1]);
        self.mouse("mouseMoved", first, "none");
        self.mouse("mousePressed", first, "left");
        for &at in path {
            self.mouse("mouseMoved", at, "left");
        }
        self.mouse("mouseReleased", last, "left");
    }

    fn mouse(&mut self, kind: &str, [x, y]: [f64; 2], button: &str) {
        let held = u8::from(button == "left" && kind != "mouseReleased");
        let event = json!({ "type": kind, "x": x, "y": y, "button": button, "buttons": held, "clickCount": 1 });
        self.call("Input.dispatchMouseEvent", event);
    }

    /// Clicks into the middle of an element.
    pub(crate) fn click_on(&mut self, selector: &str) {
        self.wait_for(selector);
        let [x, y, width, height] = self.place(selector);
        self.click([x + width / 2.0, y + height / 2.0]);
    }

    /// Left, top, width and height of an element, which is scrolled into sight.
    pub(crate) fn place(&mut self, selector: &str) -> [f64; 4] {
        let script = format!(
            "(() => {{ const e = document.querySelector({}); e.scrollIntoView({{block: 'nearest'}}); \
             const b = e.getBoundingClientRect(); return [b.x, b.y, b.width, b.height]; }})()",
            json!(selector)
        );
        serde_json::from_value(self.eval(&script)).unwrap()
    }

    /// Presses a key by its name (`ArrowLeft`, `Enter`, `s`), some others held.
    pub(crate) fn press(&mut self, key: &str, held: u64) {
        let text = match key {
            "Enter" => Some("\r"),
            key if key.chars().count() == 1 && held & (ALT | CTRL) == 0 => Some(key),
            _ => None,
        };
        let down = json!({ "type": "keyDown", "key": key, "code": code(key), "modifiers": held, "text": text,
            "windowsVirtualKeyCode": key_number(key) });
        self.call("Input.dispatchKeyEvent", down);
        let up = json!({ "type": "keyUp", "key": key, "code": code(key), "modifiers": held });
        self.call("Input.dispatchKeyEvent", up);
    }

    /// Replaces what an input holds, as by typing and leaving it: the page hears of it once.
    pub(crate) fn fill(&mut self, selector: &str, text: &str) {
        let select = format!(
            "(() => {{ const e = document.querySelector({}); e.focus(); e.select?.(); }})()",
            json!(selector)
        );
        self.eval(&select);
        self.call("Input.insertText", json!({ "text": text }));
        self.eval("document.activeElement.blur()");
    }

    /// Saves what is shown as a picture, PNG, if `PETCOMP_SCREENSHOTS` names a folder for it.
    pub(crate) fn screenshot(&mut self, name: &str) {
        let Some(folder) = std::env::var_os("PETCOMP_SCREENSHOTS") else {
            return;
        };
        self.wait("[...document.images].every((image) => image.complete)");
        let shot = self.call("Page.captureScreenshot", json!({ "format": "png" }));
        let bytes = base64(shot["data"].as_str().unwrap());
        std::fs::create_dir_all(&folder).unwrap();
        std::fs::write(Path::new(&folder).join(format!("{name}.png")), bytes).unwrap();
    }

    /// The page has complained of nothing since it was opened.
    pub(crate) fn assert_content(&self) {
        assert_eq!(self.complaints, Vec::<String>::new());
    }

    /// Calls a method of the protocol and returns its result.
    pub(crate) fn call(&mut self, method: &str, params: Value) -> Value {
        self.calls += 1;
        let mut message =
            json!({ "id": self.calls, "method": method, "params": without_nulls(params) });
        if !self.session.is_empty() {
            message["sessionId"] = json!(self.session);
        }
        self.socket
            .send(Message::text(message.to_string()))
            .unwrap();
        loop {
            let answer = self.next_message();
            if answer["id"] == json!(self.calls) {
                assert!(answer.get("error").is_none(), "{method}: {answer}");
                return answer["result"].clone();
            }
            self.complaints.extend(complaint(&answer));
        }
    }

    fn next_message(&mut self) -> Value {
        loop {
            match self.socket.read() {
                Ok(Message::Text(text)) => return serde_json::from_str(&text).unwrap(),
                // A process that was stopped and goes on.
                Err(tungstenite::Error::Io(e)) if e.kind() == ErrorKind::Interrupted => {}
                other => drop(other.unwrap()),
            }
        }
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

fn start(profile: &Path) -> Option<Child> {
    let chosen = std::env::var("PETCOMP_CHROMIUM").ok();
    let programs = chosen.iter().map(String::as_str).chain(PROGRAMS);
    programs.into_iter().find_map(|program| {
        Command::new(program)
            .args(["--headless=new", "--no-sandbox", "--disable-gpu"])
            .args([
                "--disable-dev-shm-usage",
                "--remote-debugging-port=0",
                "--hide-scrollbars",
            ])
            .args([
                "--no-first-run",
                "--disable-background-networking",
                "--disable-extensions",
            ])
            .arg(format!("--user-data-dir={}", profile.display()))
            .arg("about:blank")
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .inspect_err(|e| assert_eq!(e.kind(), ErrorKind::NotFound, "{program}: {e}"))
            .ok()
    })
}

/// `127.0.0.1:PORT/devtools/browser/ID`, as the browser prints it; what it prints later is thrown
/// away.
fn devtools_address(process: &mut Child) -> String {
    let mut lines = BufReader::new(process.stderr.take().unwrap()).lines();
    let address = lines.by_ref().map_while(Result::ok).find_map(|line| {
        let address = line.strip_prefix("DevTools listening on ws://")?;
        Some(address.to_owned())
    });
    std::thread::spawn(move || lines.for_each(drop));
    address.expect("chromium ended at once")
}

fn connect(address: &str) -> WebSocket<TcpStream> {
    let host = address.split('/').next().unwrap();
    let stream = TcpStream::connect(host).unwrap();
    stream.set_read_timeout(Some(2 * PATIENCE)).unwrap();
    stream.set_nodelay(true).unwrap();
    let limits = tungstenite::protocol::WebSocketConfig::default()
        .max_message_size(None)
        .max_frame_size(None);
    let address = format!("ws://{address}");
    let (socket, _) =
        tungstenite::client::client_with_config(address, stream, Some(limits)).unwrap();
    socket
}

/// What an event complains of, if it does.
fn complaint(event: &Value) -> Option<String> {
    let params = &event["params"];
    match event["method"].as_str()? {
        "Runtime.exceptionThrown" => {
            Some(params["exceptionDetails"]["exception"]["description"].to_string())
        }
        // A newer request took its place, which pages pass over.
        "Log.entryAdded"
            if params["entry"]["text"]
                .as_str()
                .is_some_and(|text| text.contains("410")) =>
        {
            None
        }
        "Log.entryAdded" if params["entry"]["level"] == "error" => Some(format!(
            "{} {}",
            params["entry"]["text"], params["entry"]["url"]
        )),
        "Runtime.consoleAPICalled" if params["type"] == "error" => Some(params["args"].to_string()),
        _ => None,
    }
}

fn is_true(value: &Value) -> bool {
    !matches!(value, Value::Null | Value::Bool(false)) && value != &json!(0) && value != &json!("")
}

fn without_nulls(mut params: Value) -> Value {
    if let Some(params) = params.as_object_mut() {
        params.retain(|_, value| !value.is_null());
    }
    params
}

fn code(key: &str) -> String {
    let mut letters = key.chars();
    match (letters.next(), letters.next()) {
        (Some(c), None) if c.is_ascii_alphabetic() => format!("Key{}", c.to_ascii_uppercase()),
        (Some(c), None) if c.is_ascii_digit() => format!("Digit{c}"),
        (Some(' '), None) => "Space".into(),
        _ => key.into(),
    }
}

/// Windows' number of a key, by which Chromium knows those without a letter.
fn key_number(key: &str) -> Option<u32> {
    let named = [
        ("Tab", 9),
        ("Enter", 13),
        ("Escape", 27),
        (" ", 32),
        ("PageUp", 33),
        ("PageDown", 34),
        ("End", 35),
        ("Home", 36),
        ("ArrowLeft", 37),
        ("ArrowUp", 38),
        ("ArrowRight", 39),
        ("ArrowDown", 40),
        ("Delete", 46),
        ("Backspace", 8),
    ];
    let letter = key.chars().next().filter(char::is_ascii_alphanumeric);
    named
        .iter()
        .find(|(name, _)| *name == key)
        .map(|&(_, number)| number)
        .or(letter
            .filter(|_| key.len() == 1)
            .map(|c| c.to_ascii_uppercase().into()))
}

fn base64(text: &str) -> Vec<u8> {
    const DIGITS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let digit = |c: u8| DIGITS.iter().position(|&d| d == c);
    let digits: Vec<usize> = text.bytes().filter_map(digit).collect();
    let groups = digits.chunks(4).flat_map(|group| {
        let bits = group.iter().fold(0, |bits, digit| bits << 6 | digit);
        let bits = bits << (6 * (4 - group.len()));
        let bytes = [bits >> 16, bits >> 8, bits].map(|byte| byte as u8);
        bytes.into_iter().take(group.len() - 1)
    });
    groups.collect()
}
