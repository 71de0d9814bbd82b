// SPDX-License-Identifier: MIT
// What clients of the servers over an Acromag IP330 say and hear. Requests whose `cmd`, channel or value cannot be get status -1.
//
//   scan     Int32 address=channel value=gain 0..3 extra=averaging time [ms], 0: the server's own   ──► value=0..0xffff, status 0 or -1
//   config   Int32 cmd, value                                                                       ──► status; value as said below
//   sweep    Float64 cmd, address=channel, value                                                    ──► Float64; Int32Array or Float64Array where said
//   PID      Float64 cmd, value                                                                     ──► Float64; Float64Array where said
#pragma once

#include <cstddef>
#include <cstdint>

namespace mpf::ip330server {

// NOLINTBEGIN(readability-identifier-naming): the words of ip330, mca and std

inline constexpr std::int32_t cmdSetSecondsBetweenCalibrate = 0;  // and calibrates now, once if 0; negative: never, values are raw
inline constexpr std::int32_t cmdCalibrate = 1;
inline constexpr std::int32_t cmdSetScanMode = 2;  // 0 to 5 as configIp330
inline constexpr std::int32_t cmdSetMicrosecondsPerScan = 3;  // the reply's value is what the timer makes of it, rounded
inline constexpr std::int32_t cmdStartConvert = 4;  // a scan, in the single modes; status -1 in others

// A sweep's, as mca.h has them. Those that mean nothing to a sweep are accepted and do nothing.
inline constexpr std::int32_t msgAcquire = 0;
inline constexpr std::int32_t msgRead = 1;  // the reply is an Int32Array: all points of the channel
inline constexpr std::int32_t msgSetChannelAdvanceInternal = 2;
inline constexpr std::int32_t msgSetChannelAdvanceExternal = 3;
inline constexpr std::int32_t msgSetNChan = 4;  // points
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
inline constexpr std::int32_t cmdGetParams = 10;  // the reply is a Float64Array of these

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
