//! Headless Chromium, controlled by the Chrome DevTools Protocol over a WebSocket.

use super::viewer::PATIENCE;
use crate::support::chromium;
use serde_json::{Value, json};
use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};
use tempfile::TempDir;
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Message, WebSocket, connect};

/// Page expression: true if all 16 samples of the image are shown.
pub const COMPLETE: &str =
    "document.documentElement.dataset.phase === 'complete' && document.documentElement.dataset.samples === '16'";

/// A browser with open pages.
pub struct Browser {
    child: Child,
    socket: WebSocket<MaybeTlsStream<TcpStream>>,
    next: u64,
    _profile: TempDir,
}

impl Browser {
    pub fn start() -> Self {
        let profile = tempfile::tempdir().unwrap();
        let mut child = Command::new(chromium())
            .args([
                "--headless=new",
                "--no-sandbox",
                "--disable-gpu",
                "--remote-debugging-port=0",
                "--no-first-run",
            ])
            .args([
                "--disable-background-timer-throttling",
                "--disable-renderer-backgrounding",
            ])
            .args([
                "--disable-backgrounding-occluded-windows",
                "--disable-dev-shm-usage",
                "--hide-scrollbars",
            ])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg("about:blank")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(child.stderr.take().unwrap()).lines();
        let address = lines
            .find_map(|line| Some(line.ok()?.strip_prefix("DevTools listening on ")?.to_string()))
            .expect("Chromium does not say where it listens");
        // Read later output, so that the browser never blocks.
        thread::spawn(move || lines.for_each(drop));
        let (socket, _) = connect(address.trim()).unwrap();
        if let MaybeTlsStream::Plain(stream) = socket.get_ref() {
            stream.set_read_timeout(Some(PATIENCE)).unwrap();
        }
        Self {
            child,
            socket,
            next: 0,
            _profile: profile,
        }
    }

    pub fn call(&mut self, session: Option<&str>, method: &str, parameters: Value) -> Value {
        self.next += 1;
        let mut call = json!({ "id": self.next, "method": method, "params": parameters });
        if let Some(session) = session {
            call["sessionId"] = session.into();
        }
        self.socket.send(Message::text(call.to_string())).unwrap();
        loop {
            let Message::Text(text) = self.socket.read().unwrap() else {
                continue;
            };
            let answer: Value = serde_json::from_str(&text).unwrap();
            if answer["id"] == self.next {
                assert!(answer.get("error").is_none(), "{method}: {answer}");
                return answer["result"].clone();
            }
        }
    }

    /// Opens a page of this size and loads `link`.
    pub fn open(&mut self, link: &str, [width, height]: [u32; 2]) -> Tab {
        let target = self.call(None, "Target.createTarget", json!({ "url": "about:blank" }));
        let attach = json!({ "targetId": target["targetId"], "flatten": true });
        let session = self.call(None, "Target.attachToTarget", attach)["sessionId"].clone();
        let tab = Tab(session.as_str().unwrap().into());
        let size = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        self.call(Some(&tab.0), "Emulation.setDeviceMetricsOverride", size);
        // Record script errors for the tests.
        let note = "window.faults = []; addEventListener('error', e => faults.push(e.message)); addEventListener('unhandledrejection', e => faults.push(String(e.reason)));";
        self.call(Some(&tab.0), "Page.enable", json!({}));
        self.call(
            Some(&tab.0),
            "Page.addScriptToEvaluateOnNewDocument",
            json!({ "source": note }),
        );
        self.call(Some(&tab.0), "Page.navigate", json!({ "url": link }));
        tab
    }

    /// Value of an expression on a page.
    pub fn value(&mut self, tab: &Tab, expression: &str) -> Value {
        let what = json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let found = self.call(Some(&tab.0), "Runtime.evaluate", what);
        assert!(found.get("exceptionDetails").is_none(), "{expression}: {found}");
        found["result"]["value"].clone()
    }

    /// Waits until an expression is true on a page.
    pub fn wait(&mut self, tab: &Tab, expression: &str) {
        let start = Instant::now();
        let guarded = format!("(() => {{ try {{ return Boolean({expression}) }} catch {{ return false }} }})()");
        while self.value(tab, &guarded) != true {
            if start.elapsed() > PATIENCE {
                let state = self.value(tab, "document.body.innerText + JSON.stringify(window.faults)");
                panic!("never: {expression}\n{state}");
            }
            thread::sleep(Duration::from_millis(50));
        }
    }

    pub fn mouse(&mut self, tab: &Tab, kind: &str, [x, y]: [f64; 2], more: Value) {
        let mut event = json!({ "type": kind, "x": x, "y": y, "button": "none" });
        event.as_object_mut().unwrap().extend(more.as_object().unwrap().clone());
        self.call(Some(&tab.0), "Input.dispatchMouseEvent", event);
    }

    pub fn drag(&mut self, tab: &Tab, from: [f64; 2], to: [f64; 2]) {
        let left = json!({ "button": "left", "buttons": 1, "clickCount": 1 });
        self.mouse(tab, "mousePressed", from, left.clone());
        for step in 1..=8 {
            let at = [0, 1].map(|i| from[i] + (to[i] - from[i]) * f64::from(step) / 8.0);
            self.mouse(tab, "mouseMoved", at, left.clone());
        }
        self.mouse(tab, "mouseReleased", to, json!({ "button": "left", "clickCount": 1 }));
    }

    pub fn click(&mut self, tab: &Tab, at: [f64; 2]) {
        self.drag(tab, at, at);
    }

    pub fn press(&mut self, tab: &Tab, key: &str, code: &str) {
        for kind in ["keyDown", "keyUp"] {
            self.call(
                Some(&tab.0),
                "Input.dispatchKeyEvent",
                json!({ "type": kind, "key": key, "code": code }),
            );
        }
    }

    /// Centre of the image in the window, and its size there.
    pub fn picture(&mut self, tab: &Tab) -> ([f64; 2], [f64; 2]) {
        let r = self.value(tab, "(({x, y, width, height}) => [x, y, width, height])(document.getElementById('picture').getBoundingClientRect())");
        let n = [0, 1, 2, 3].map(|i| r[i].as_f64().unwrap());
        ([n[0] + n[2] / 2.0, n[1] + n[3] / 2.0], [n[2], n[3]])
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}

/// A page of the browser.
pub struct Tab(pub String);

/// Sets a control in the same way as a user.
pub fn set(browser: &mut Browser, tab: &Tab, selector: &str, property: &str) {
    let set = format!(
        "(() => {{ const control = document.querySelector({selector:?}); Object.assign(control, {property}); control.dispatchEvent(new Event('input')); control.dispatchEvent(new Event('change')); }})()"
    );
    browser.value(tab, &set);
}

pub fn click_on(browser: &mut Browser, tab: &Tab, id: &str) {
    browser.value(tab, &format!("document.getElementById('{id}').click()"));
}
