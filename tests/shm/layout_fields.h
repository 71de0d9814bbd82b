// SPDX-License-Identifier: MIT
// Every field of layout.h with its offset, as JSON. A test compares it with the tables of
// docs/shm-layout.md.
#pragma once

#include <cstddef>
#include <nlohmann/json.hpp>

#include "shm/layout.h"

namespace mpf::test {

#define MPF_FIELD(name)                                     \
  {                                                         \
    #name, { offsetof(Struct, name), sizeof(Struct::name) } \
  }

inline nlohmann::json layoutFields() {
  using namespace layout;
  nlohmann::json all;
  {
    using Struct = SegmentHeader;
    constexpr auto kReserved = offsetof(Struct, hops) + sizeof(Struct::hops);
    all["SegmentHeader"] = {{"bytes", kHeaderBytes},
                            {"fields",
                             {MPF_FIELD(magic),
                              MPF_FIELD(layoutMajor),
                              MPF_FIELD(layoutMinor),
                              MPF_FIELD(kind),
                              MPF_FIELD(totalBytes),
                              MPF_FIELD(incarnation),
                              MPF_FIELD(ownerWindow),
                              MPF_FIELD(ownerPid),
                              MPF_FIELD(ownerUid),
                              MPF_FIELD(ownerStartTicks),
                              MPF_FIELD(pidNamespace),
                              MPF_FIELD(createdMonotonicNs),
                              MPF_FIELD(createdRealtimeNs),
                              MPF_FIELD(location),
                              MPF_FIELD(takesBarriers),
                              MPF_FIELD(backplane),
                              MPF_FIELD(name),
                              MPF_FIELD(program),
                              MPF_FIELD(queueSlots),
                              MPF_FIELD(replySlots),
                              MPF_FIELD(queueSize),
                              MPF_FIELD(maxOutstanding),
                              MPF_FIELD(maxMessageBytes),
                              MPF_FIELD(maxPoolBytes),
                              MPF_FIELD(linkMode),
                              MPF_FIELD(linkGroup),
                              MPF_FIELD(waitMode),
                              MPF_FIELD(clientIndex),
                              MPF_FIELD(serverWindow),
                              MPF_FIELD(clientWindow),
                              MPF_FIELD(ringBytesOffset),
                              MPF_FIELD(chunkBytes),
                              MPF_FIELD(chunkCount),
                              MPF_FIELD(bulkSide),
                              MPF_FIELD(moreReplySlots),
                              MPF_FIELD(hops),
                              {"reserved", {kReserved, kHeaderBytes - kReserved}}}}};
  }
  {
    using Struct = WindowControl;
    all["WindowControl"] = {
        {"bytes", sizeof(Struct)},
        {"fields", {MPF_FIELD(sleeping),       MPF_FIELD(sleepNumber), MPF_FIELD(state),
                    MPF_FIELD(linkCount),      MPF_FIELD(queueSize),   MPF_FIELD(shortage),
                    MPF_FIELD(progressAtNs),   MPF_FIELD(received),    MPF_FIELD(sent),
                    MPF_FIELD(replyQueueFull), MPF_FIELD(queueFull),   MPF_FIELD(expired),
                    MPF_FIELD(refused),        MPF_FIELD(wakes),       MPF_FIELD(linksOpened),
                    MPF_FIELD(linksClosed),    MPF_FIELD(peersDied),   MPF_FIELD(protocolErrors),
                    MPF_FIELD(alarms),         MPF_FIELD(handling),    MPF_FIELD(sentElsewhere),
                    MPF_FIELD(reserved),       MPF_FIELD(queueWaitNs), MPF_FIELD(serviceNs)}}};
  }
  {
    using Struct = Histogram;
    all["Histogram"] = {{"bytes", sizeof(Struct)},
                        {"fields", {MPF_FIELD(buckets), MPF_FIELD(maxNs), MPF_FIELD(reserved)}}};
  }
  {
    using Struct = WindowHints;
    all["WindowHints"] = {{"bytes", sizeof(Struct)},
                          {"fields",
                           {{"header", {0, kHeaderBytes}},
                            MPF_FIELD(bell),
                            MPF_FIELD(knocked),
                            MPF_FIELD(rescan),
                            MPF_FIELD(knocks),
                            MPF_FIELD(readyWords),
                            MPF_FIELD(readyBits)}}};
  }
  {
    using Struct = LinkControl;
    all["LinkControl"] = {
        {"bytes", sizeof(Struct)},
        {"fields",
         {MPF_FIELD(clientState), MPF_FIELD(serverState), MPF_FIELD(requestWatch),
          MPF_FIELD(replyWatch), MPF_FIELD(serverIndex), MPF_FIELD(hasMoreReplies),
          MPF_FIELD(requestsPolledOn), MPF_FIELD(repliesPolledOn), MPF_FIELD(replies),
          MPF_FIELD(clientSent), MPF_FIELD(clientRefused), MPF_FIELD(clientAnswered),
          MPF_FIELD(requests), MPF_FIELD(serverSent), MPF_FIELD(repliesMoved),
          MPF_FIELD(requestChunks), MPF_FIELD(replyChunks)}}};
  }
  {
    using Struct = RingControl;
    all["RingControl"] = {{"bytes", sizeof(Struct)},
                          {"fields", {MPF_FIELD(freed), MPF_FIELD(taken)}}};
  }
  {
    using Struct = Slot;
    all["Slot"] = {
        {"bytes", sizeof(Struct)},
        {"fields",
         {MPF_FIELD(sequence), MPF_FIELD(type), MPF_FIELD(slots), MPF_FIELD(flags),
          MPF_FIELD(bodyBytes), MPF_FIELD(requestId), MPF_FIELD(clientType), MPF_FIELD(clientExtra),
          MPF_FIELD(sentTick), MPF_FIELD(deadlineNs), MPF_FIELD(body)}}};
  }
  {
    using Struct = MoreSlot;
    all["MoreSlot"] = {{"bytes", sizeof(Struct)},
                       {"fields", {MPF_FIELD(sequence), MPF_FIELD(body)}}};
  }
  {
    using Struct = ReturnRing;
    all["ReturnRing"] = {{"bytes", sizeof(Struct)},
                         {"fields", {MPF_FIELD(returned), MPF_FIELD(chunks)}}};
  }
  {
    using Struct = ChunkRef;
    all["ChunkRef"] = {{"bytes", sizeof(Struct)},
                       {"fields",
                        {MPF_FIELD(segment), MPF_FIELD(chunk), MPF_FIELD(side), MPF_FIELD(missed),
                         MPF_FIELD(cmd)}}};
  }
  {
    using Struct = RouterLine;
    all["RouterLine"] = {{"bytes", sizeof(Struct)},
                         {"fields",
                          {MPF_FIELD(state),
                           MPF_FIELD(role),
                           MPF_FIELD(isTls),
                           MPF_FIELD(texts),
                           MPF_FIELD(sinceNs),
                           MPF_FIELD(connects),
                           MPF_FIELD(queueSize),
                           MPF_FIELD(inQueue),
                           MPF_FIELD(queueFull),
                           MPF_FIELD(messagesSent),
                           MPF_FIELD(messagesReceived),
                           MPF_FIELD(framesSent),
                           MPF_FIELD(framesReceived),
                           MPF_FIELD(bytesSent),
                           MPF_FIELD(bytesReceived),
                           MPF_FIELD(roundTripNs),
                           MPF_FIELD(clients),
                           MPF_FIELD(bindings),
                           MPF_FIELD(address),
                           MPF_FIELD(peer),
                           MPF_FIELD(program),
                           MPF_FIELD(locations),
                           MPF_FIELD(problem)}}};
  }
  return all;
}

#undef MPF_FIELD

inline nlohmann::json layoutConstants() {
  using namespace layout;
  return {{"magic", kMagic},
          {"layoutMajor", kMajor},
          {"layoutMinor", kMinor},
          {"windowControlOffset", kWindowControlOffset},
          {"linkControlOffset", kLinkControlOffset},
          {"linkRingsOffset", kLinkRingsOffset},
          {"bulkChunksOffset", kBulkChunksOffset},
          {"maxLinks", kMaxLinks},
          {"maxRingSlots", kMaxRingSlots},
          {"maxMessageSlots", kMaxMessageSlots},
          {"continuesInSecondRing", kContinuesInSecondRing},
          {"inlineBodyBytes", kInlineBodyBytes},
          {"knocks", kKnocks},
          {"returnSlots", kReturnSlots},
          {"returnsFanOut", kReturnsFanOut},
          {"histogramBuckets", kHistogramBuckets},
          {"routerLinesOffset", kRouterLinesOffset},
          {"routerLines", kRouterLines}};
}

inline nlohmann::json layoutKinds() {
  using layout::SegmentKind;
  return {{"serverWindow", SegmentKind::serverWindow},
          {"clientWindow", SegmentKind::clientWindow},
          {"hints", SegmentKind::hints},
          {"link", SegmentKind::link},
          {"bulk", SegmentKind::bulk},
          {"pendingBind", SegmentKind::pendingBind},
          {"router", SegmentKind::router},
          {"fanOut", SegmentKind::fanOut}};
}

}  // namespace mpf::test
