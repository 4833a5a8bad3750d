"""Runs petcomp and other programs on the same input and cores, round by round, and writes the results.

A script creates a Comparison, adds a Peer for every program and setting, and calls `finish`. Each peer runs once per round,
so that any other load on the machine affects all of them. Seconds are processor time, user plus system, of all threads and
children; on the single core that `taskset` gives, they equal wall-clock time on an idle machine.

A comparison measures either WHOLE processes, with start-up and files, or only the work INSIDE them, never both. A point is
compared with petcomp's default, or with another setting of petcomp that does the same thing.
"""

import argparse
import contextlib
import functools
import json
import os
import pathlib
import re
import resource
import shlex
import statistics
import subprocess
import sys
import time
from dataclasses import dataclass, field
from typing import Callable

ROOT = pathlib.Path(__file__).resolve().parents[3]
WHOLE = "whole processes, with their start and their files"
INSIDE = "the work alone, pictures and data in memory"
CORES = sorted(os.sched_getaffinity(0))
PINNED = ["taskset", "-c", ",".join(map(str, CORES))]


@dataclass
class Peer:
    """A program at one setting. `run` does the work once and returns seconds; `error` and `more` return the error and
    further measures of the last run's result."""

    program: str
    version: str
    setting: str
    command: str
    run: Callable[[], float]
    error: Callable[[], float]
    beside: str = ""
    more: Callable[[], dict] = dict
    seconds: list = field(default_factory=list)

    def point(self):
        return {"program": self.program, "version": self.version, "setting": self.setting, "command": self.command,
                "error": float(self.error()), "seconds": statistics.median(self.seconds), "runs": len(self.seconds),
                "least": min(self.seconds), "most": max(self.seconds), "beside": self.beside, "also": self.more()}


class Comparison:
    """A comparison, with the peers that take part and those that are absent."""

    def __init__(self, stage, args, counted, input, error, reference):
        self.stage, self.args = stage, args
        self.told = {"stage": stage, "input": f"{input}; {counted}", "error": error, "reference": reference,
                     "threads": len(CORES), "clock": "processor seconds, median"}
        self.peers, self.absent, self.points = [], [], []

    def add(self, *args, **named):
        self.peers.append(Peer(*args, **named))

    @contextlib.contextmanager
    def absent_if_it_fails(self, program):
        """Wrap work that needs another program: if that is missing or fails, list it as absent and continue."""
        try:
            yield
        except Exception as error:  # whatever another program's failure looks like
            said = (getattr(error, "stdout", None) or "").strip().splitlines()[-1:]
            self.leave_out(program, " ".join([f"{type(error).__name__}: {error}", *said]))

    def leave_out(self, program, why):
        self.absent.append({"program": program, "why": why})
        print(f"absent: {program}: {why}", file=sys.stderr)

    def finish(self):
        """Run all peers in turn, measure errors, write the JSON and print the table."""
        for _ in range(self.args.runs):
            for peer in list(self.peers):
                self.attempt(peer, lambda: peer.seconds.append(peer.run()))
        for peer in list(self.peers):
            self.attempt(peer, lambda: self.points.append(peer.point()))
        self.args.output.mkdir(parents=True, exist_ok=True)
        path = self.args.output / f"{self.stage.replace(' ', '_')}.json"
        path.write_text(json.dumps({**self.told, "points": self.points, "absent": self.absent}, indent=1) + "\n")
        print(self.table())

    def attempt(self, peer, action):
        """Mark a peer that fails as absent; if petcomp fails, the comparison fails."""
        if peer.program == "petcomp":
            return action()
        before = len(self.absent)
        with self.absent_if_it_fails(f"{peer.program}, {peer.setting}"):
            action()
        if len(self.absent) > before:
            self.peers.remove(peer)

    def table(self):
        ours = {p["setting"]: p for p in self.points if p["program"] == "petcomp"}
        usual = next((p for name, p in ours.items() if "default" in name), next(iter(ours.values()), None))
        lines = [f"## {self.stage}: {self.told['input']}", "", f"Error: {self.told['error']}. Reference: "
                 f"{self.told['reference']}. Median of {self.args.runs}, {len(CORES)} core(s), processor seconds.", "",
                 "| program | setting | error | seconds | times petcomp's seconds | beside | also |", "|" + " --- |" * 7]
        for p in self.points:
            beside = p["program"] != "petcomp" and ours.get(p["beside"], usual)
            ratio = f"{p['seconds'] / beside['seconds']:.3g} | {beside['setting']}" if beside else "|"
            also = ", ".join(f"{name} {value:.7g}" for name, value in p["also"].items() if value is not None)
            lines.append(f"| {p['program']} {p['version']} | {p['setting']} | {p['error']:.4g} | {p['seconds']:.4g} | {ratio} "
                         f"| {also} |")
        lines += [f"| {a['program']} | absent: {a['why']} | | | | | |" for a in self.absent]
        return "\n".join(lines) + "\n"


def arguments(doc):
    """Return a parser with the options that all scripts share."""
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("-o", "--output", type=pathlib.Path, default=pathlib.Path("target/peers"), metavar="FOLDER")
    parser.add_argument("-n", "--runs", type=int, default=5, help="rounds (default: %(default)s)")
    parser.add_argument("--petcomp", default="target/release/petcomp", metavar="PROGRAM")
    parser.add_argument("--report", default="target/release/petcomp-report", metavar="PROGRAM")
    os.chdir(ROOT)
    return parser


def pinned(*command):
    """Return a command that runs on the cores of this process, as it is run and printed."""
    return PINNED + [str(word) for word in command]


def told(command):
    return shlex.join(command)


def spent(command, env=None, accept=(0,)):
    """Run a command; return the processor seconds of it and its children, and its output."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, env=env)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    if done.returncode not in accept:
        raise subprocess.CalledProcessError(done.returncode, told(command), done.stdout)
    return after.ru_utime - before.ru_utime + after.ru_stime - before.ru_stime, done.stdout


def seconds_of(command, accept=(0,)):
    return spent(command, accept=accept)[0]


def here(action):
    """Run an action in this process; return its processor seconds and its result."""
    start = time.process_time()
    given = action()
    return time.process_time() - start, given


def version(command, pattern=r"(\d+\.\d+[^\s,]*)"):
    """Return the first text in the output of a command that looks like a version."""
    return re.search(pattern, spent(command)[1]).group(1)


@functools.cache
def library():
    """Return the path of tests/benches/peers/library.rs, a program for petcomp's library; build it if needed."""
    build = ["cargo", "build", "--quiet", "--release", "--locked", "--bench", "peers", "--message-format=json"]
    said = subprocess.run(build, stdout=subprocess.PIPE, text=True, check=True).stdout
    built = [json.loads(line) for line in said.splitlines()]
    path, = [m["executable"] for m in built if m.get("executable") and m["target"]["name"] == "peers"]
    return os.path.relpath(path, ROOT)


def library_seconds(program, times, *task):
    """Processor seconds of one piece of work: those of a process that does it `times` times, minus those of one that only
    reads, divided by `times`."""
    return (seconds_of(pinned(program, times, *task)) - seconds_of(pinned(program, 0, *task))) / times
