// SPDX-License-Identifier: MIT
// The messages between the four servers of an Acromag IP330 and their clients. A request with an
// invalid `cmd`, channel or value gets status -1.
//
//   server   request                                        reply
//   scan     Int32 address=channel                          Int32 value=0 to 0xffff, status
//            value=gain code 0 to 3, for gain 1, 2, 4, 8
//            extra=averaging time [ms], 0: the server's default
//   config   Int32 cmd, value                               Int32 status; value as below
//   sweep    Float64 cmd, address=channel, value            Float64; arrays as below
//   PID      Float64 cmd, value                             Float64; arrays as below
//
// Source   manual, "EXAMPLE Implementation: ip330Scan"; the EPICS modules ip330, mca and std.
#pragma once

#include <cstddef>
#include <cstdint>

#include <mpf/detail/cpp20.h>

namespace mpf::ip330server {

// NOLINTBEGIN(readability-identifier-naming): names of the EPICS modules ip330, mca and std

// `cmd` of the config server. Calibrates now, and then every `value` seconds; 0: only now;
// negative: never, and values are raw.
inline constexpr std::int32_t cmdSetSecondsBetweenCalibrate = 0;
// Calibrates now.
inline constexpr std::int32_t cmdCalibrate = 1;
// value = 0 to 5, as configIp330.
inline constexpr std::int32_t cmdSetScanMode = 2;
// value = [us]; the value of the reply is the nearest time that the timer of the module can
// produce.
inline constexpr std::int32_t cmdSetMicrosecondsPerScan = 3;
// Starts a scan in the single modes; status -1 in the other modes.
inline constexpr std::int32_t cmdStartConvert = 4;

// `cmd` of the sweep server, with the numbers of mca.h. The server ignores
// msgSetChannelAdvance..., msgSetCounts, msgSetLoChan, msgSetHiChan, msgSetNSweeps, msgSetMode...,
// msgSetSeq and msgSetPscl, with status 0.
inline constexpr std::int32_t msgAcquire = 0;
// The reply is an Int32Array: all points of the channel.
inline constexpr std::int32_t msgRead = 1;
inline constexpr std::int32_t msgSetChannelAdvanceInternal = 2;
inline constexpr std::int32_t msgSetChannelAdvanceExternal = 3;
inline constexpr std::int32_t msgSetNChan = 4;  // number of points
inline constexpr std::int32_t msgSetDwell = 5;  // [s] per point
// Both set the time after which a sweep ends [s]; 0: no limit.
inline constexpr std::int32_t msgSetRealTime = 6;
inline constexpr std::int32_t msgSetLiveTime = 7;
inline constexpr std::int32_t msgSetCounts = 8;
inline constexpr std::int32_t msgSetLoChan = 9;
inline constexpr std::int32_t msgSetHiChan = 10;
inline constexpr std::int32_t msgSetNSweeps = 11;
inline constexpr std::int32_t msgSetModePha = 12;
inline constexpr std::int32_t msgSetModeMcs = 13;
inline constexpr std::int32_t msgSetModeList = 14;
// The reply is a Float64Array: acquiring (0 or 1), real time [s], live time [s], total counts,
// dwell time [s].
inline constexpr std::int32_t msgGetAcqStatus = 15;
inline constexpr std::int32_t msgStopAcquisition = 16;
inline constexpr std::int32_t msgErase = 17;
inline constexpr std::int32_t msgSetSeq = 18;
inline constexpr std::int32_t msgSetPscl = 19;

// `cmd` of the PID server. Set point, actual value and error are in counts of the IP330 (0 to
// 65535); output, P, I, D and the limits are codes of the DAC128V (0 to 4095). KI is in 1/s, KD in
// s.
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
// The reply is a Float64Array with the elements that follow.
inline constexpr std::int32_t cmdGetParams = 10;

// Indices of the elements.
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
