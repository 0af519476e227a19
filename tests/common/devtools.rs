//! A browser that a test controls over a pipe with Chromium's DevTools protocol: JSON messages that end in a zero byte.

use serde_json::{Value, json};
use std::fs::{File, OpenOptions};
use std::io::{BufRead, BufReader, Write};
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A page in its own browser process.
pub struct Page {
    browser: Child,
    send: File,
    receive: BufReader<File>,
    session: Option<String>,
    last: u64,
    /// Console messages and exceptions reported by the page.
    pub complaints: Vec<Value>,
}

impl Page {
    /// Opens an address. `folder` holds the browser's profile and pipes.
    pub fn open(browser: &Path, folder: &Path, address: &str) -> Self {
        let pipes = ["in", "out"].map(|name| folder.join(name));
        for pipe in &pipes {
            assert!(Command::new("mkfifo").arg(pipe).status().unwrap().success());
        }
        let script = "exec \"$0\" --headless --no-sandbox --disable-gpu --remote-debugging-pipe \"$1\" about:blank 3<\"$2\" 4>\"$3\"";
        let browser = Command::new("sh")
            .args(["-c", script])
            .arg(browser)
            .arg(format!("--user-data-dir={}", folder.join("profile").display()))
            .args(&pipes)
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let send = OpenOptions::new().write(true).open(&pipes[0]).unwrap();
        let receive = BufReader::new(File::open(&pipes[1]).unwrap());
        let mut page = Self { browser, send, receive, session: None, last: 0, complaints: Vec::new() };
        let target = page.call("Target.createTarget", &json!({ "url": "about:blank" }))["targetId"].clone();
        let session = page.call("Target.attachToTarget", &json!({ "targetId": target, "flatten": true }));
        page.session = session["sessionId"].as_str().map(str::to_owned);
        for domain in ["Runtime.enable", "Log.enable", "Page.enable"] {
            page.call(domain, &json!({}));
        }
        page.call("Page.navigate", &json!({ "url": address }));
        page
    }

    /// Calls a method and returns its result. Messages that arrive meanwhile are kept if they are complaints.
    pub fn call(&mut self, method: &str, parameters: &Value) -> Value {
        self.last += 1;
        let mut message = json!({ "id": self.last, "method": method, "params": parameters });
        if let Some(session) = &self.session {
            message["sessionId"] = json!(session);
        }
        self.send.write_all(format!("{message}\0").as_bytes()).unwrap();
        loop {
            let mut bytes = Vec::new();
            assert!(self.receive.read_until(0, &mut bytes).unwrap() > 0, "the browser has closed the pipe");
            bytes.pop();
            let mut message: Value = serde_json::from_slice(&bytes).unwrap();
            if message["id"] == self.last {
                assert!(message["error"].is_null(), "{method}: {message}");
                return message["result"].take();
            }
            let thrown = message["method"] == "Runtime.exceptionThrown";
            let logged = message["method"] == "Log.entryAdded" && message["params"]["entry"]["level"] == "error";
            if thrown || logged {
                self.complaints.push(message["params"].take());
            }
        }
    }

    /// Evaluates an expression in the page and returns its value.
    pub fn ask(&mut self, expression: &str) -> Value {
        let parameters = json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let answer = self.call("Runtime.evaluate", &parameters);
        assert!(answer["exceptionDetails"].is_null(), "{expression}: {answer}");
        answer["result"]["value"].clone()
    }

    /// Waits until an expression in the page is true; panics after 120 seconds.
    pub fn wait(&mut self, expression: &str) {
        let begin = Instant::now();
        while self.ask(&format!("Boolean({expression})")) != true {
            let seen = || format!("{expression}\n{:?}", begin.elapsed());
            assert!(begin.elapsed() < Duration::from_secs(120), "never: {}", seen());
            std::thread::sleep(Duration::from_millis(100));
        }
    }

    /// Sets the size of the page's window.
    pub fn resize(&mut self, width: u32, height: u32) {
        let size = json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": false });
        self.call("Emulation.setDeviceMetricsOverride", &size);
    }

    /// Takes a screenshot of the window, encoded as PNG.
    pub fn screenshot(&mut self) -> Vec<u8> {
        use base64::Engine;
        let answer = self.call("Page.captureScreenshot", &json!({ "format": "png" }));
        base64::engine::general_purpose::STANDARD.decode(answer["data"].as_str().unwrap()).unwrap()
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        let _ = self.browser.kill();
        let _ = self.browser.wait();
    }
}
