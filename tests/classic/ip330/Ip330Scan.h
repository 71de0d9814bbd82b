// SPDX-License-Identifier: MIT
// Ip330Scan: the means of the channels of an IP330.
//
// The header is that of the manual, "EXAMPLE Implementation: ip330Scan", section "Ip330Scan.h". The
// lines between "completed" and "manual" stand for the "..." of the manual.
#ifndef IP330SCAN_H
#define IP330SCAN_H

// ---- the manual
class WatchDog;
class MessageServer;
class IndustryPackModule;
class ip330ADCregs;
class ip330ADCchans;

enum signalType {differential, singleEnded};
class Ip330Scan
{
public:
    static Ip330Scan * init(
        const char *moduleName, const char *carrierName,
        const char *siteName,
        const char *type,const char *range,int intVec);
    int getValue(int channel);
    int setGain(int gain,int channel);
private:
    Ip330Scan(IndustryPackModule *pIndustryPackModule,
         signalType type, int range, int intVec);
// ---- completed
    int accumulated;
    struct Board;
    Board *pBoard;
    int gain[32];
// ---- the manual
};
// ---- completed
#endif
