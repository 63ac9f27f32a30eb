"""That the site which tools/docs has made works in a browser: site_in_browser.py SITE_FOLDER

Starts Debian's chromium without a window. Opens every page of the site from the disk; searches, and follows the
first hit, from the disk and from a server of this machine. A fault is a file that is not there, an error of a script,
a picture that is not shown, a table whose cells have no padding, or a search that does not find. Ends with 77 where
chromium is not installed.
"""

import contextlib
import functools
import http.server
import json
import os
import pathlib
import shutil
import subprocess
import sys
import tempfile
import threading

SKIPPED = 77
OPTIONS = ["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run",
           "--disable-background-networking", "--disable-component-update", "--disable-sync", "--remote-debugging-pipe",
           "--window-size=1280,1000"]
SEARCHES = {"friction": "Coulomb", "contact.start": "contact.start", "temperature_max": "temperature_max"}
ALL_SHOWN = "[...document.images].filter(image => !image.complete || !image.naturalWidth).map(image => image.src)"
PADDING = "[...document.querySelectorAll('td')].map(cell => parseFloat(getComputedStyle(cell).paddingLeft))"


class Browser:
    """Chromium with one page, driven by its DevTools protocol: JSON texts that end with a 0 byte, in file descriptor 3
    and out of 4."""

    def __init__(self, profile):
        to_browser, from_browser = os.pipe(), os.pipe()
        self.process = subprocess.Popen(
            ["bash", "-c", f'exec "$@" 3<&{to_browser[0]} 4>&{from_browser[1]}', "bash", "chromium", *OPTIONS,
             f"--user-data-dir={profile}"],
            pass_fds=(to_browser[0], from_browser[1]), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        os.close(to_browser[0])
        os.close(from_browser[1])
        self.to_browser, self.from_browser = to_browser[1], from_browser[0]
        self.received, self.calls, self.events, self.session = b"", 0, [], {}
        target = self.call("Target.createTarget", url="about:blank")["targetId"]
        self.session = {"sessionId": self.call("Target.attachToTarget", targetId=target, flatten=True)["sessionId"]}
        for domain in ("Page", "Runtime", "Log"):
            self.call(f"{domain}.enable")

    def message(self):
        while b"\0" not in self.received:
            some = os.read(self.from_browser, 1 << 16)
            if not some:
                raise EOFError("chromium has ended")
            self.received += some
        text, _, self.received = self.received.partition(b"\0")
        return json.loads(text)

    def call(self, method, **params):
        self.calls += 1
        text = json.dumps({"id": self.calls, "method": method, "params": params, **self.session})
        os.write(self.to_browser, text.encode() + b"\0")
        while (told := self.message()).get("id") != self.calls:
            self.events.append(told)
        if "error" in told:
            raise ValueError(f"{method}: {told['error']['message']}")
        return told["result"]

    def wait_for_page(self):
        while not any(event["method"] == "Page.loadEventFired" for event in self.events):
            self.events.append(self.message())

    def go(self, address):
        self.events = []
        self.call("Page.navigate", url=address)
        self.wait_for_page()

    def value(self, script):
        return self.call("Runtime.evaluate", expression=script, returnByValue=True)["result"].get("value")

    def act(self, script):
        """A script that leads to another page."""
        self.events = []
        self.value(script)
        self.wait_for_page()

    def faults(self):
        """What the browser has said of the page."""
        for event in self.events:
            if event["method"] == "Log.entryAdded":
                entry = event["params"]["entry"]
                yield f"{entry['text']} {entry.get('url', '')}"
            elif event["method"] == "Runtime.exceptionThrown":
                details = event["params"]["exceptionDetails"]
                yield details.get("exception", {}).get("description", details["text"])

    def close(self):
        self.session = {}
        with contextlib.suppress(EOFError):
            self.call("Browser.close")
        self.process.wait()


def faults_of_page(browser):
    yield from browser.faults()
    yield from (f"{image}: not shown" for image in browser.value(ALL_SHOWN))
    padding = browser.value(PADDING)
    if padding and min(padding) < 4:
        yield f"a cell of a table has {min(padding)} pixels of padding, expected 4 or more"


def faults_of_search(browser, site):
    for words, expected in SEARCHES.items():
        browser.go(f"{site}/docs/limits.html")
        yield from browser.faults()
        browser.act("document.querySelector('[role=search] input').value = '" + words + "';"
                    "document.querySelector('[role=search] form').submit()")
        yield from browser.faults()
        if not browser.value("document.querySelectorAll('#search-results article').length"):
            yield f"{words}: nothing found: {browser.value('document.body.innerText')[-200:]}"
            continue
        browser.act("document.querySelector('#search-results a').click()")
        yield from browser.faults()
        address, text = browser.value("[location.href, document.body.innerText]")
        anchor = browser.value("document.getElementById(location.hash.slice(1)) !== null")
        if not address.startswith(site) or "search.html" in address or expected not in text or not anchor:
            yield f"{words}: the first hit leads to {address}, which lacks {expected} or the place"
    browser.go(f"{site}/search.html?q=nosuchword")
    if "No section" not in browser.value("document.body.innerText"):
        yield "nosuchword: the page does not say that nothing was found"


class QuietHandler(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


def main():
    site = pathlib.Path(sys.argv[1]).resolve()
    if shutil.which("chromium") is None:
        print("Skipped: chromium, Debian's package of that name, is not installed")
        sys.exit(SKIPPED)
    pages = sorted(site.rglob("*.html"))
    server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(QuietHandler, directory=site))
    threading.Thread(target=server.serve_forever, daemon=True).start()
    faults = []
    with tempfile.TemporaryDirectory(prefix="pellicle_site_", ignore_cleanup_errors=True) as profile:
        browser = Browser(profile)
        for page in pages:
            browser.go(page.as_uri())
            faults += [f"{page.relative_to(site)}: {fault}" for fault in faults_of_page(browser)]
        for address in (site.as_uri(), f"http://127.0.0.1:{server.server_address[1]}"):
            faults += [f"{address}: {fault}" for fault in faults_of_search(browser, address)]
        browser.close()
    print(*faults, f"{len(pages)} pages, {len(faults)} faults", sep="\n")
    sys.exit(1 if faults or not pages else 0)


if __name__ == "__main__":
    main()
