//! A screen without a monitor, and the program on it with a user's hands and eyes.

use std::io::{BufRead, BufReader};
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use x11rb::connection::Connection;
use x11rb::protocol::xproto::{AtomEnum, ClientMessageEvent, ConnectionExt, EventMask};

/// Programs this needs beside the system's libraries.
const PROGRAMS: [&str; 3] = ["Xvfb", "xdotool", "import"];
/// Longest wait for anything on a slow computer.
const PATIENCE: Duration = Duration::from_secs(20);

/// The first program that is not installed.
pub fn missing() -> Option<&'static str> {
    let path = std::env::var_os("PATH").unwrap_or_default();
    let folders: Vec<PathBuf> = std::env::split_paths(&path).collect();
    PROGRAMS.into_iter().find(|program| !folders.iter().any(|folder| folder.join(program).is_file()))
}

/// Asks again and again until there is an answer.
pub fn wait<T>(what: &str, ask: impl FnMut() -> Option<T>) -> T {
    within(PATIENCE, ask).unwrap_or_else(|| panic!("waited in vain for {what}"))
}

fn within<T>(limit: Duration, mut ask: impl FnMut() -> Option<T>) -> Option<T> {
    let begun = Instant::now();
    loop {
        let answer = ask();
        if answer.is_some() || begun.elapsed() > limit {
            return answer;
        }
        std::thread::sleep(Duration::from_millis(100));
    }
}

/// Ends its process when it goes out of scope, whatever happened.
struct Guard(Child);

impl Drop for Guard {
    fn drop(&mut self) {
        drop(self.0.kill());
        drop(self.0.wait());
    }
}

/// A virtual screen of 1440 × 900 and a folder for all that programs on it write.
pub struct Desk {
    display: String,
    folder: tempfile::TempDir,
    _screen: Guard,
}

impl Desk {
    /// A screen under a number that is free.
    pub fn new() -> Self {
        let screen = Command::new("Xvfb")
            // Without -noreset it starts over when its last client leaves, and turns away who comes meanwhile.
            .args(["-displayfd", "1", "-screen", "0", "1440x900x24", "-nolisten", "tcp", "-noreset"])
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn();
        let mut screen = Guard(screen.expect("Xvfb starts"));
        let mut number = String::new();
        let said = screen.0.stdout.take().expect("piped");
        BufReader::new(said).read_line(&mut number).expect("Xvfb gives its number");
        assert!(!number.trim().is_empty(), "Xvfb found no free screen");
        let folder = tempfile::tempdir().expect("a folder");
        for name in ["config", "recordings", "system"] {
            std::fs::create_dir(folder.path().join(name)).expect("made");
        }
        Self { display: format!(":{}", number.trim()), folder, _screen: screen }
    }

    /// Where files are put.
    pub fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// Starts Vasos in a language and waits until its window is drawn.
    pub fn open(&self, arguments: &[&str], language: &str) -> Window<'_> {
        let said = self.folder().join("stderr.txt");
        let system = self.folder().join("system");
        let program = Command::new(env!("CARGO_BIN_EXE_vasos"))
            .args(arguments)
            .current_dir(self.folder())
            .env("DISPLAY", &self.display)
            .env_remove("WAYLAND_DISPLAY")
            .env_remove("DBUS_SESSION_BUS_ADDRESS")
            .env("LIBGL_ALWAYS_SOFTWARE", "1")
            .env("LC_ALL", language)
            .env("RUST_BACKTRACE", "0")
            .env("VASOS_CONFIG_DIR", self.folder().join("config"))
            .env("VASOS_RECORDINGS_DIR", self.folder().join("recordings"))
            .env("XDG_DATA_HOME", &system)
            .env("XDG_CONFIG_HOME", &system)
            .env("XDG_RUNTIME_DIR", &system)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(std::fs::File::create(&said).expect("made"))
            .spawn();
        let program = Guard(program.expect("vasos starts"));
        let mut window = Window { desk: self, program, id: String::new(), said };
        window.id = window.wait("a window", |w| {
            let found = self.hand(&["search", "--onlyvisible", "--name", "^Vasos"]);
            w.assert_alive();
            found.lines().next().map(str::to_owned)
        });
        window.wait("a picture", |_| (self.look().colours() > 60).then_some(()));
        self.hand(&["windowfocus", "--sync", &window.id]);
        window
    }

    fn hand(&self, arguments: &[&str]) -> String {
        let output = Command::new("xdotool").args(arguments).env("DISPLAY", &self.display).output();
        String::from_utf8_lossy(&output.expect("xdotool runs").stdout).trim().to_owned()
    }

    /// What the screen shows.
    pub fn look(&self) -> Picture {
        let output = Command::new("import")
            .args(["-display", &self.display, "-window", "root", "-depth", "8", "ppm:-"])
            .output()
            .expect("import runs");
        Picture::parse(&output.stdout)
    }
}

/// The program with its window.
pub struct Window<'a> {
    desk: &'a Desk,
    program: Guard,
    id: String,
    said: PathBuf,
}

impl Window<'_> {
    /// Presses a key, for example `ctrl+r`.
    pub fn press(&self, key: &str) {
        self.desk.hand(&["key", key]);
    }

    /// The title as it stands above the window.
    pub fn title(&self) -> String {
        self.desk.hand(&["getwindowname", &self.id])
    }

    /// Asks until there is an answer; what the program said on standard error explains a wait in vain.
    pub fn wait<T>(&mut self, what: &str, mut ask: impl FnMut(&mut Self) -> Option<T>) -> T {
        let answer = within(PATIENCE, || ask(self));
        answer.unwrap_or_else(|| panic!("waited in vain for {what}; standard error: {}", self.said()))
    }

    /// Waits until nothing moves: two looks, one picture.
    pub fn wait_still(&mut self) -> Picture {
        let mut before = self.desk.look();
        self.wait("a picture that stands still", |w| {
            let now = w.desk.look();
            let still = now.difference(&before, 0..now.height) == 0.0;
            before = now;
            still.then(|| before.clone())
        })
    }

    /// Share of one processor that the program takes over half a second.
    pub fn load(&self) -> f64 {
        let begun = (Instant::now(), self.ticks());
        std::thread::sleep(Duration::from_millis(500));
        // A tick is 10 ms on every Linux of today.
        0.01 * (self.ticks() - begun.1) / begun.0.elapsed().as_secs_f64()
    }

    fn ticks(&self) -> f64 {
        let stat = std::fs::read_to_string(format!("/proc/{}/stat", self.program.0.id())).expect("it runs");
        let fields = stat.rsplit(')').next().expect("fields").split_whitespace();
        fields.skip(11).take(2).map(|ticks| ticks.parse::<f64>().expect("a number")).sum()
    }

    /// What it wrote on standard error.
    pub fn said(&self) -> String {
        std::fs::read_to_string(&self.said).unwrap_or_default()
    }

    /// Fails when the program has ended.
    pub fn assert_alive(&mut self) {
        let ended = self.program.0.try_wait().expect("asked");
        assert!(ended.is_none(), "it ended with {ended:?}; standard error: {}", self.said());
    }

    /// Closes the window as its cross does, and checks that the program ends well and has not panicked.
    pub fn close(mut self) {
        let status = self.closed().expect("the screen takes a message");
        assert!(status.success(), "{status}, signal {:?}: {}", status.signal(), self.said());
        assert!(!self.said().contains("panicked"), "{}", self.said());
    }

    fn closed(&mut self) -> Result<ExitStatus, Box<dyn std::error::Error>> {
        let (screen, _) = x11rb::connect(Some(&self.desk.display))?;
        let atom = |name: &str| -> Result<u32, Box<dyn std::error::Error>> {
            Ok(screen.intern_atom(false, name.as_bytes())?.reply()?.atom)
        };
        let (protocols, delete) = (atom("WM_PROTOCOLS")?, atom("WM_DELETE_WINDOW")?);
        let window = self.id.parse()?;
        let supported = screen.get_property(false, window, protocols, AtomEnum::ATOM, 0, 16)?.reply()?;
        assert!(supported.value32().is_some_and(|mut atoms| atoms.any(|a| a == delete)));
        let message = ClientMessageEvent::new(32, window, protocols, [delete, 0, 0, 0, 0]);
        screen.send_event(false, window, EventMask::NO_EVENT, message)?;
        screen.flush()?;
        Ok(self.wait("the end", |w| w.program.0.try_wait().expect("asked")))
    }
}

/// A picture of the screen.
#[derive(Clone)]
pub struct Picture {
    /// Rows.
    pub height: usize,
    width: usize,
    rgb: Vec<u8>,
}

impl Picture {
    /// Of binary PPM with 8 bits a colour.
    fn parse(ppm: &[u8]) -> Self {
        let mut parts = ppm.splitn(4, |byte| byte.is_ascii_whitespace());
        let mut word = || parts.next().map(|w| String::from_utf8_lossy(w).into_owned()).unwrap_or_default();
        assert_eq!(word(), "P6", "import gives a picture");
        let (width, height) = (word().parse().expect("a width"), word().parse().expect("a height"));
        let rgb = ppm[ppm.len() - 3 * width * height..].to_vec();
        Self { height, width, rgb }
    }

    /// How many colours there are, counted until that is plenty.
    pub fn colours(&self) -> usize {
        let mut seen = std::collections::BTreeSet::new();
        let mut pixels = self.rgb.chunks_exact(3).step_by(7);
        while seen.len() < 200
            && let Some(pixel) = pixels.next()
        {
            seen.insert(pixel);
        }
        seen.len()
    }

    /// How many pixels have a colour.
    pub fn count(&self, colour: [u8; 3]) -> usize {
        self.rgb.chunks_exact(3).filter(|pixel| *pixel == colour).count()
    }

    /// Share of the pixels in some rows that differ.
    pub fn difference(&self, other: &Self, rows: std::ops::Range<usize>) -> f64 {
        let bytes = 3 * self.width * rows.start..3 * self.width * rows.end;
        let pairs = self.rgb[bytes.clone()].chunks_exact(3).zip(other.rgb[bytes].chunks_exact(3));
        pairs.filter(|(a, b)| a != b).count() as f64 / (rows.len() * self.width) as f64
    }
}
