# SPDX-License-Identifier: MIT
# The commands of a startup file of the old MPF. $(HOST) and $(PORT): the environment.
routerInit
localMessageRouterStart(0)
tcpMessageRouterClientStart(1, $(PORT), "$(HOST)", 1500, 40)
dbLoadRecords("number.db", "P=rst:,R=int32,SERVER=Int32,LOCATION=1")
dbLoadRecords("text.db", "P=rst:,R=text,SERVER=Char8Array,LOCATION=1,TEXT=value")
dbLoadRecords("text.db", "P=rst:,R=serial0,SERVER=serial[0],LOCATION=1,TEXT=line 0:")
dbLoadRecords("text.db", "P=rst:,R=serial1,SERVER=serial[1],LOCATION=1,TEXT=line 1:")
dbLoadRecords("text.db", "P=rst:,R=serial2,SERVER=serial[2],LOCATION=1,TEXT=line 2:")
dbLoadRecords("text.db", "P=rst:,R=serial3,SERVER=serial[3],LOCATION=1,TEXT=line 3:")
dbLoadRecords("text.db", "P=rst:,R=serial4,SERVER=serial[4],LOCATION=1,TEXT=line 4:")
dbLoadRecords("text.db", "P=rst:,R=serial5,SERVER=serial[5],LOCATION=1,TEXT=line 5:")
dbLoadRecords("text.db", "P=rst:,R=serial6,SERVER=serial[6],LOCATION=1,TEXT=line 6:")
dbLoadRecords("text.db", "P=rst:,R=serial7,SERVER=serial[7],LOCATION=1,TEXT=line 7:")
iocInit
