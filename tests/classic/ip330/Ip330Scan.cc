// SPDX-License-Identifier: MIT
// Ip330Scan: the means of the channels of an IP330.
//
// init() is that of the manual, "EXAMPLE Implementation: ip330Scan", section "Ip330Scan.cc". The
// manual suppresses "all device specific code": the lines below "completed" stand for it, and use
// the driver of MPF. It also serves the interrupts, which the constructor of the manual connects.
#include <stdio.h>
#include <string.h>

#include <chrono>
#include <exception>
#include <optional>

#include "IndustryPackModule.h"
#include "Ip330Scan.h"
#include "drivers/ip330/ip330_scan.h"

#define ACROMAG_ID 0xa3
#define ACRO_IP330 0x11

// ---- the manual
Ip330Scan * Ip330Scan::init(
    const char *moduleName, const char *carrierName, const char *siteName,
    const char *typeString,const char *rangeString, int intVec)
{
    IndustryPackModule *pIPM = IndustryPackModule::createIndustryPackModule(
        moduleName,carrierName,siteName);
    if(!pIPM) return(0);
    unsigned char manufacturer = pIPM->getManufacturer();
    unsigned char model = pIPM->getModel();
    if(manufacturer!=ACROMAG_ID) {
        printf("initIp330Scan manufacturer 0x%x not ACROMAG_ID\n",
            manufacturer);
        return(0);
    }
    if(model!=ACRO_IP330) {
       printf("initIp330Scan model 0x%x not a ACRO_IP330\n",model);
       return(0);
    }
// ---- completed
    signalType type = strcmp(typeString,"D")==0 ? differential : singleEnded;
    int range;
    try {
        range = static_cast<int>(mpf::parseIp330Range(rangeString));
    } catch(const std::exception &error) {
        printf("initIp330Scan %s\n",error.what());
        return(0);
    }
// ---- the manual
    Ip330Scan *pIp330Scan = new Ip330Scan(pIPM,type,range,intVec);
    return(pIp330Scan);
}

// ---- completed
struct Ip330Scan::Board {
    Board(IndustryPackModule *pIPM,const mpf::Ip330Settings &settings)
    : ip330(pIPM->open(mpf::kIp330),settings),
      scan(ip330,settings.firstChannel,settings.lastChannel) {}
    mpf::Ip330 ip330;
    mpf::Ip330Scan scan;
};

Ip330Scan:: Ip330Scan(
    IndustryPackModule *pIndustryPackModule,
    signalType type, int range, int intVec)
: accumulated(200)
{
    mpf::Ip330Settings settings;
    settings.type = type==differential
        ? mpf::Ip330Type::differential : mpf::Ip330Type::singleEnded;
    settings.lastChannel = mpf::channelsOf(settings.type) - 1;
    settings.range = static_cast<mpf::Ip330Range>(range);
    settings.vector = intVec;
    pBoard = new Board(pIndustryPackModule,settings);
    memset(gain,0,sizeof(gain));
}

int Ip330Scan::setGain(int newGain,int channel)
{
    if(!pBoard->ip330.trySetGain(channel,newGain)) return(-1);
    gain[channel] = newGain;
    return(0);
}

int Ip330Scan::getValue(int channel)
{
    std::optional<int> mean = pBoard->scan.tryRead(
        channel,gain[channel],std::chrono::milliseconds(accumulated));
    return(mean.value_or(0));
}
