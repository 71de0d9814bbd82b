# Commands of an IOC of EPICS Base; LIBRARY is the folder of libdevAiIp330Scan.so.
on error break
dlload $(LIBRARY)/libdevAiIp330Scan.so
dbLoadDatabase devAiIp330Scan.dbd
registerAllRecordDeviceDrivers pdbbase
dbLoadRecords ip330Scan.db
iocInit
