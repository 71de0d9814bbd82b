# SPDX-License-Identifier: MIT
"""bare_ioc.py ST_CMD: an IOC of EPICS Base and nothing else, with the PyPI package epicscorelibs.
Runs the commands of ST_CMD, then those of standard input, as softIoc of Base does."""
import sys

from epicscorelibs import ioc

ioc.iocshRegisterCommon()
for name in b"base.dbd", b"dlload.dbd":
    if ioc.dbLoadDatabase(name, ioc.DEFAULT_DBD_PATH.encode(), None):
        sys.exit(f"cannot load {name.decode()}")
ioc.registerRecordDeviceDriver(ioc.pdbbase)
if ioc.Com.iocsh(sys.argv[1].encode()) or ioc.Com.iocsh(None):
    sys.exit("a command failed: see the error above")
