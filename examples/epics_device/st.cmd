# Commands of an IOC; LIBRARY is the folder of libpulses.so.
on error break
dlload $(LIBRARY)/libpulses.so
dbLoadDatabase pulses.dbd
registerAllRecordDeviceDrivers pdbbase
dbLoadRecords pulses.db, "P=lab:"
iocInit
