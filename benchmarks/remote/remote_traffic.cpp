// SPDX-License-Identifier: MIT
// The rows of `mpf bench remote` about round trips: the manual's table, and arrays of 1 MiB.
#include "benchmarks/peers/mpf_peer.h"
#include "benchmarks/remote/bare_peer.h"
#include "benchmarks/remote/remote.h"
#include "benchmarks/remote/routers.h"
#include "benchmarks/remote/tcp_peer.h"
#include "benchmarks/stage/timing.h"

namespace mpf::bench {
namespace {

constexpr std::size_t kInt32 = 4;
constexpr std::size_t kArray = 1u << 20;
constexpr int kQueueSize = 1024;  // up to 1000 requests wait

using PeerMaker = std::function<std::shared_ptr<Peer>()>;

// The messages of an exchange, which is repeated.
struct Traffic {
  int sends = 1;           // sends in a row, before all their replies are received
  int messages = 1;        // messages in all sends of an exchange together
  std::size_t window = 0;  // not 0: instead of exchanges, this number of messages is outstanding
  bool inRuns = false;     // MpfPlaces::inRuns
};

// `writer` is the pid of the process that has the client's socket.
Outcome goThereAndBack(const Stage& stage, const std::shared_ptr<Peer>& peer,
                       const Traffic& traffic, int writer) {
  Workload workload;
  workload.stopsByItself = true;
  workload.scratchBytes = kBareScratchBytes;  // other peers do not use it
  workload.server = [=](const RunContext& context) { peer->serve(context); };
  workload.requester = [=, &stage](const RunContext& context) {
    peer->connect(context);
    Meter meter(stage.placement(), writer);
    if (traffic.window != 0) {
      timeWindow(context, meter, traffic.window, [&] { peer->send(); }, [&] { peer->receive(); });
    } else {
      timeExchanges(context, meter, static_cast<std::uint64_t>(traffic.messages), [&] {
        for (int i = 0; i < traffic.sends; ++i) peer->send();
        for (int i = 0; i < traffic.sends; ++i) peer->receive();
      });
    }
    context.stop();
    peer->roundTrip();
  };
  return stage.run(workload);
}

Measurement tcpRow(const Place& place, const std::string& question, const std::string& name,
                   const Traffic& traffic, std::size_t unitBytes) {
  auto row = rowAt(place, question, "raw TCP, " + name, false);
  row.mode = Mode::block;
  row.bytes = unitBytes * static_cast<std::size_t>(traffic.sends) /
              static_cast<std::size_t>(traffic.messages);
  row.run = [=, between = place.between](const Stage& stage) {
    const std::shared_ptr<Peer> peer = makeTcpPeer({between, unitBytes, traffic.window > 1});
    return goThereAndBack(stage, peer, traffic, Meter::kThisProcess);
  };
  return row;
}

Measurement localRow(const Place& place, const std::string& question, const std::string& name,
                     const Traffic& traffic) {
  auto row = rowAt(place, question, "MPF local, " + name, false);
  row.bytes = kInt32;
  const auto backplane = place.runName + "-local";
  row.run = [=, mode = place.wait](const Stage& stage) {
    const MpfPlaces places{
        .serverBackplane = backplane, .clientBackplane = backplane, .queueSize = kQueueSize};
    const std::shared_ptr<Peer> peer =
        makeMpfPeer<Float64Array>({mode, kInt32, false, backplane}, places);
    auto outcome = goThereAndBack(stage, peer, traffic, Meter::kNobody);
    peer->removeTraces();
    return outcome;
  };
  return row;
}

template <class Array = Float64Array>
Measurement remoteRow(const Place& place, const std::string& question, const std::string& name,
                      const Traffic& traffic, std::size_t bytes) {
  auto row = rowAt(place, question, "MPF remote, " + name, true);
  row.bytes = bytes;
  row.run = [=, mode = place.wait, routers = place.routers](const Stage& stage) {
    const MpfPlaces places{.serverBackplane = routers->serverBackplane(),
                           .clientBackplane = routers->clientBackplane(),
                           .location = kRemoteLocation,
                           .queueSize = kQueueSize,
                           .inRuns = traffic.inRuns};
    const std::shared_ptr<Peer> peer = makeMpfPeer<Array>({mode, bytes, false, {}}, places);
    return routers->run([&] { return goThereAndBack(stage, peer, traffic, routers->clientPid()); });
  };
  return row;
}

// Frames of as many bytes as routers write for these messages.
Measurement bareRow(const Place& place, const std::string& question, const std::string& name,
                    int messages) {
  auto row = rowAt(place, question, "four bare processes, " + name, false);
  row.mode = Mode::block;
  row.bytes = kInt32;
  row.run = [=, between = place.between](const Stage& stage) {
    const std::shared_ptr<Peer> peer =
        makeBarePeer(between, bareFrameBytes(static_cast<std::size_t>(messages)));
    return goThereAndBack(stage, peer, {1, messages}, Meter::kNobody);
  };
  return row;
}

Measurement besides(Measurement row, const std::string& rawTcp) {
  row.floorName = "raw TCP, " + rawTcp;
  row.floorBytes = row.bytes;
  return row;
}

}  // namespace

std::vector<Measurement> messageRows(const Place& place, bool withLocal) {
  const std::string none = "no buffer";
  const std::string gathered = "100 in one write";
  const std::string gathered1000 = "1000 in one write";
  const Traffic one{1, 1}, hundred{100, 100}, thousand{1000, 1000};
  const Traffic hundredInRuns{100, 100, 0, true}, thousandInRuns{1000, 1000, 0, true};
  std::vector<Measurement> rows;
  rows.push_back(tcpRow(place, kMessages, none, one, kInt32));
  rows.push_back(tcpRow(place, kMessages, gathered, {1, 100}, 100 * kInt32));
  rows.push_back(besides(tcpRow(place, kMessages, "100, a write each", hundred, kInt32), gathered));
  rows.push_back(tcpRow(place, kMessages, gathered1000, {1, 1000}, 1000 * kInt32));
  if (withLocal) {
    rows.push_back(besides(localRow(place, kMessages, none, one), none));
    rows.push_back(besides(localRow(place, kMessages, "100 buffered", hundred), gathered));
    rows.push_back(besides(localRow(place, kMessages, "1000 buffered", thousand), gathered1000));
  }
  rows.push_back(besides(bareRow(place, kMessages, none, 1), none));
  rows.push_back(besides(bareRow(place, kMessages, "frames of 100", 100), gathered));
  rows.push_back(besides(remoteRow(place, kMessages, none, one, kInt32), none));
  rows.push_back(besides(remoteRow(place, kMessages, "100 buffered", hundred, kInt32), gathered));
  rows.push_back(
      besides(remoteRow(place, kMessages, "1000 buffered", thousand, kInt32), gathered1000));
  rows.push_back(besides(
      remoteRow(place, kMessages, "100 buffered, in batches", hundredInRuns, kInt32), gathered));
  rows.push_back(
      besides(remoteRow(place, kMessages, "1000 buffered, in batches", thousandInRuns, kInt32),
              gathered1000));
  return rows;
}

std::vector<Measurement> arrayRows(const Place& place) {
  std::vector<Measurement> rows;
  for (const std::size_t window : {std::size_t{1}, std::size_t{4}}) {
    const auto name =
        window == 1 ? std::string("one at a time") : std::to_string(window) + " in flight";
    const Traffic traffic{1, 1, window};
    rows.push_back(tcpRow(place, kArrays, name, traffic, kArray));
    rows.push_back(besides(
        remoteRow<Float64Array>(place, kArrays, "Float64Array, " + name, traffic, kArray), name));
    rows.push_back(besides(
        remoteRow<Int32Array>(place, kArrays, "Int32Array, " + name, traffic, kArray), name));
  }
  return rows;
}

}  // namespace mpf::bench
