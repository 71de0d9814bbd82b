// SPDX-License-Identifier: MIT
// The messages between the servers of an Acromag IP330 and their clients. A request with an invalid
// `cmd`, channel or value gets status -1.
//
//            request                                              reply
//   scan     Int32 address=channel value=gain code 0..3           value=0..0xffff, status 0 or -1
//            extra=averaging time [ms], 0: the server's default
//   config   Int32 cmd, value                                     Int32 status; value as below
//   sweep    Float64 cmd, address=channel, value                  Float64; Int32Array or
//            Float64Array as below
//   PID      Float64 cmd, value                                   Float64; Float64Array as below
#pragma once

#include <cstddef>
#include <cstdint>

namespace mpf::ip330server {

// NOLINTBEGIN(readability-identifier-naming): names of the EPICS modules ip330, mca and std

// also calibrates now; 0: only now; negative: never, values are raw
inline constexpr std::int32_t cmdSetSecondsBetweenCalibrate = 0;
inline constexpr std::int32_t cmdCalibrate = 1;
inline constexpr std::int32_t cmdSetScanMode = 2;  // 0 to 5 as configIp330
// the value of the reply is the time that the timer gives, rounded
inline constexpr std::int32_t cmdSetMicrosecondsPerScan = 3;
// starts a scan in the single modes; status -1 in others
inline constexpr std::int32_t cmdStartConvert = 4;

// Commands of a sweep, with the numbers of mca.h. Commands without a meaning for a sweep are
// accepted and have no effect.
inline constexpr std::int32_t msgAcquire = 0;
inline constexpr std::int32_t msgRead = 1;  // the reply is an Int32Array: all points of the channel
inline constexpr std::int32_t msgSetChannelAdvanceInternal = 2;
inline constexpr std::int32_t msgSetChannelAdvanceExternal = 3;
inline constexpr std::int32_t msgSetNChan = 4;  // number of points
inline constexpr std::int32_t msgSetDwell = 5;  // seconds per point
inline constexpr std::int32_t msgSetRealTime = 6;
inline constexpr std::int32_t msgSetLiveTime = 7;
inline constexpr std::int32_t msgSetCounts = 8;
inline constexpr std::int32_t msgSetLoChan = 9;
inline constexpr std::int32_t msgSetHiChan = 10;
inline constexpr std::int32_t msgSetNSweeps = 11;
inline constexpr std::int32_t msgSetModePha = 12;
inline constexpr std::int32_t msgSetModeMcs = 13;
inline constexpr std::int32_t msgSetModeList = 14;
inline constexpr std::int32_t msgGetAcqStatus =
    15;  // the reply is a Float64Array: acquiring, real time, live time, total counts, dwell time
inline constexpr std::int32_t msgStopAcquisition = 16;
inline constexpr std::int32_t msgErase = 17;
inline constexpr std::int32_t msgSetSeq = 18;
inline constexpr std::int32_t msgSetPscl = 19;

inline constexpr std::int32_t cmdStartFeedback = 0;
inline constexpr std::int32_t cmdStopFeedback = 1;
inline constexpr std::int32_t cmdSetHighLimit = 2;
inline constexpr std::int32_t cmdSetLowLimit = 3;
inline constexpr std::int32_t cmdSetKP = 4;
inline constexpr std::int32_t cmdSetKI = 5;
inline constexpr std::int32_t cmdSetKD = 6;
inline constexpr std::int32_t cmdSetI = 7;
inline constexpr std::int32_t cmdSetSecondsPerScan = 8;
inline constexpr std::int32_t cmdSetSetPoint = 9;
inline constexpr std::int32_t cmdGetParams = 10;  // the reply is a Float64Array with these elements

inline constexpr std::size_t offsetActual = 0;
inline constexpr std::size_t offsetError = 1;
inline constexpr std::size_t offsetOutput = 2;
inline constexpr std::size_t offsetP = 3;
inline constexpr std::size_t offsetI = 4;
inline constexpr std::size_t offsetD = 5;
inline constexpr std::size_t offsetSecondsPerScan = 6;
inline constexpr std::size_t numFastPIDOffsets = 7;

// NOLINTEND(readability-identifier-naming)

}  // namespace mpf::ip330server
