#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""echo_lines PATH...: pseudo-terminals, each with a link PATH to it, that send back each byte."""
import os
import selectors
import sys
import tty

lines = selectors.DefaultSelector()
for path in sys.argv[1:]:
    device, terminal = os.openpty()
    tty.setraw(terminal)  # stays open: a line without a user is no error
    lines.register(device, selectors.EVENT_READ)
    os.symlink(os.ttyname(terminal), path)
while True:
    for line, _ in lines.select():
        os.write(line.fd, os.read(line.fd, 4096))
