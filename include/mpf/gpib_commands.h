// SPDX-License-Identifier: MIT
// The commands and statuses of GPIB servers. Client and server exchange Char8Array messages:
//
//   request   cmd = command | options
//             address: the instrument: 0 to 30, or 100 * primary + secondary address
//             value = bytes to write, commands, or a name
//             extra: longest read [bytes], or what the command says
//             eomLen, eomString: a read ends at the first byte that is equal to the last byte of
//             eomString, which is the only one that is used; eomLen 0: no such byte
//             timeout [s], or [ms] with cmdTimeoutMilliseconds: the wait for the bus and the
//             operation together, from the arrival of the request; 0: the server's default
//   reply     status = gpibStatus..., extra = gpibReadEnded... of a read, value = bytes that were
//             read; the other fields are those of the request
//
// A request whose timeout has passed gets its reply then, even while an instrument holds up the
// requests of others. Each client's requests are executed in their order, and clients take turns.
// Requests of a client that is gone are dropped, unless they have begun.
//
//   client                          server                                instrument 22
//     cmd=cmdSubscribe address=22 ──►
//                                 ◄── status=gpibStatusOK
//                                                                     ◄── SRQ
//                                 ◄── OutOfBand cmd=cmdSubscribe address=22 value=status byte
//     cmd=cmdUnsubscribe          ──►
//                                 ◄── status=gpibStatusOK                       the last message
//
// <mpf/gpib_sniff.h> describes how to listen to the bus. docs/messages.md has examples.
//
// Source   manual, "Gpib Support". No public source gives the messages of the original gpibServer;
//          these are of this project. Commands, options and statuses that serial servers have, too,
//          have the same numbers (<mpf/serial_commands.h>).
#pragma once

#include <cstdint>

#include <mpf/detail/cpp20.h>

namespace mpf::gpib {

// NOLINTBEGIN(readability-identifier-naming): same style as the names of serial_commands.h

// `cmd` of a request: one command, OR-ed with any options.

// Reads until END (the EOI line), the end of string or `extra` bytes; extra 0: the server's buffer
// size.
inline constexpr std::int32_t cmdRead = 1;
// Writes `value`, the last byte with END.
inline constexpr std::int32_t cmdWrite = 2;
// Writes `value`, then reads. Nothing comes between the two.
inline constexpr std::int32_t cmdWriteRead = cmdRead | cmdWrite;
// Serial poll; the value of the reply is the status byte.
inline constexpr std::int32_t cmdSerialPoll = 4;
// Selected device clear (SDC). `address` allInstruments: device clear (DCL) of all.
inline constexpr std::int32_t cmdClear = 5;
// Group execute trigger (GET) of `address` and of the addresses in `value`, two bytes each: the
// primary address, and the secondary address or noSecondaryAddress.
inline constexpr std::int32_t cmdTrigger = 6;
// Interface clear (IFC).
inline constexpr std::int32_t cmdInterfaceClear = 7;
// Remote enable (REN): extra 1 on, 0 off.
inline constexpr std::int32_t cmdRemoteEnable = 8;
// Local lockout (LLO) of all instruments.
inline constexpr std::int32_t cmdLocalLockout = 9;
// Go to local (GTL).
inline constexpr std::int32_t cmdGoToLocal = 10;
// Sends the bytes of `value` with ATN, exactly these.
inline constexpr std::int32_t cmdSendCommands = 11;

// Makes the bus exclusive to this client, for `extra` milliseconds from the reply on; a holder that
// asks again extends its lease. `value` is the name of the holder, for messages to people. The
// lease ends earlier with cmdUnlease, or when the client disconnects or dies. The extra of the
// reply is the number of milliseconds, which the server limits. Requests of others wait for the end
// of the lease until their timeout.
inline constexpr std::int32_t cmdLease = 12;
// Ends the lease of this client, if it has one.
inline constexpr std::int32_t cmdUnlease = 13;
// Asks for the holder of the lease, and does not wait for the bus. The value of the reply is the
// holder's name, its extra the number of milliseconds that are left; empty and 0 without a lease.
inline constexpr std::int32_t cmdLeaseHolder = 14;

// From now on, when the instrument requests service, the server polls it and sends an OutOfBand
// message with cmd = cmdSubscribe, address, and value = status byte. extra = number of such
// messages that were dropped before this one, because this client did not take the earlier ones in
// time. The same message is sent when a cmdSerialPoll of any client returns a status byte that
// requests service. Does not wait for the bus. During a lease, the server polls only instruments to
// which the holder subscribes.
inline constexpr std::int32_t cmdSubscribe = 15;
// Ends the subscription of this client to `address`; allInstruments: all its subscriptions.
inline constexpr std::int32_t cmdUnsubscribe = 16;
// The bits of the command; the others are options.
inline constexpr std::int32_t cmdCommandMask = 0xff;

// Options.

// `timeout` is in milliseconds instead of seconds.
inline constexpr std::int32_t cmdTimeoutMilliseconds = 0x100;
// Writes the last byte without END. Not for cmdWriteRead.
inline constexpr std::int32_t cmdWithoutEnd = 0x200;

// `address` of a request that concerns all instruments.
inline constexpr std::int32_t allInstruments = -1;
// A byte in the value of cmdTrigger.
inline constexpr std::uint8_t noSecondaryAddress = 0xff;

// `status` of a reply. `value` has all bytes that were read, unless the status says
// otherwise.
inline constexpr std::int32_t gpibStatusOK = 0;
// The instrument did not answer or accept bytes in time, or the bus was busy until the timeout.
inline constexpr std::int32_t gpibStatusTimeout = 1;
// The answer is longer than the server's buffer; the next read returns the rest.
inline constexpr std::int32_t gpibStatusOverflow = 2;
// The controller or the bus failed; the log of the server has the reason.
inline constexpr std::int32_t gpibStatusError = 3;
// No instrument accepted the bytes: none is at the address, or it is off.
inline constexpr std::int32_t gpibStatusNoListener = 4;
// This kind of controller cannot do it.
inline constexpr std::int32_t gpibStatusUnsupported = 5;
// Another client held the lease until the timeout; `value` is its name.
inline constexpr std::int32_t gpibStatusLeased = 6;
// The request is invalid: an unknown command or option, an address or a field out of range; `value`
// is the reason, in words.
inline constexpr std::int32_t gpibStatusInvalid = 7;

// `extra` of the reply to a read: what ended it; 0: its timeout or an error.
inline constexpr std::int32_t gpibReadEndedByEnd = 1;
inline constexpr std::int32_t gpibReadEndedByString = 2;
inline constexpr std::int32_t gpibReadEndedByCount = 3;

// NOLINTEND(readability-identifier-naming)

}  // namespace mpf::gpib
