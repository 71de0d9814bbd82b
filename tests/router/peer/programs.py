# SPDX-License-Identifier: MIT
# Starts the real programs, on backplanes of this process. stopAll() and the watchdog end all of
# them.
import faulthandler
import json
import os
import signal
import subprocess
import threading


def patient(options):
  """Options of a router, with times that a busy host does not exceed unless a test sets them."""
  times = [time for time in ("--dead-time", "--handshake-time") if time not in options]
  return [*options, *(word for time in times for word in (time, "60s"))]


class Programs:
  def __init__(self, folder):
    self.folder_ = folder
    self.running = []
    self.backplanes_ = []

  def backplane(self, name):
    """A unique name of a backplane; `name` distinguishes those of one test."""
    full = f"mpf-peer-{os.getpid()}-{len(self.backplanes_)}-{name}"
    self.backplanes_.append(full)
    return full

  def start(self, backplane, program, *arguments, **options):
    command = [os.path.join(self.folder_, program), *map(str, arguments)]
    started = subprocess.Popen(
      command, env={**os.environ, "MPF_BACKPLANE": backplane}, text=True, **options
    )
    self.running.append(started)
    return started

  def router(self, backplane, *arguments):
    """Starts a router that listens; returns the program and its address."""
    ready, write = os.pipe()
    try:
      router = self.start(
        backplane,
        "mpf-router",
        "--backplane",
        backplane,
        *patient(arguments),
        "--listen",
        "127.0.0.1:0",
        "--plain",
        "--ready-fd",
        write,
        pass_fds=(write,),
      )
    finally:
      os.close(write)
    with os.fdopen(ready) as lines:
      host, port = lines.readline().strip().rsplit(":", 1)
    return router, (host, int(port))

  def remoteRouter(self, backplane, location, address, *options):
    """Starts a router that connects to `address` for the servers at `location`."""
    remote = f"{location}={address[0]}:{address[1]}"
    return self.start(
      backplane,
      "mpf-router",
      "--backplane",
      backplane,
      "--remote",
      remote,
      "--plain",
      *patient(options),
    )

  def call(self, backplane, *arguments):
    """Starts `mpf call` with a long timeout; the caller reads its output."""
    return self.start(
      backplane,
      "mpf",
      "call",
      *arguments,
      "--timeout",
      600,
      stdout=subprocess.PIPE,
      stderr=subprocess.PIPE,
    )

  def called(self, backplane, *arguments):
    """Runs `mpf call --json`; returns its output, its errors and its exit status."""
    call = self.call(backplane, *arguments, "--json")
    out, error = call.communicate()
    return (json.loads(out) if out.startswith("{") else out), error, call.returncode

  def pause(self, program):
    """Sends SIGSTOP; after the return the program does not run."""
    program.send_signal(signal.SIGSTOP)
    os.waitpid(program.pid, os.WUNTRACED)

  def stop(self, program):
    program.send_signal(signal.SIGCONT)
    program.terminate()
    program.wait()

  def kill(self, program):
    program.kill()
    program.wait()

  def stopAll(self):
    for program in reversed(self.running):
      if program.poll() is None:
        self.stop(program)
      for end in (program.stdout, program.stderr):
        if end:
          end.close()
    self.clean()
    self.running, self.backplanes_ = [], []

  def clean(self):
    """Removes the segments of killed programs."""
    for backplane in self.backplanes_:
      subprocess.run(
        [os.path.join(self.folder_, "mpf"), "clean", "--backplane", backplane],
        stdout=subprocess.DEVNULL,
        check=False,
      )

  def watchdog(self, seconds):
    """Ends this process and its programs when a test hangs."""
    def bark():
      faulthandler.dump_traceback()
      for program in self.running:
        self.kill(program)
      self.clean()
      os._exit(1)
    timer = threading.Timer(seconds, bark)
    timer.daemon = True
    timer.start()
    return timer
