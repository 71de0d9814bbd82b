// SPDX-License-Identifier: MIT
// The measurements that are made with every peer.
#include <algorithm>

#include "benchmarks/peers/external_peer.h"
#include "benchmarks/stage/measurement.h"
#include "benchmarks/stage/timing.h"

namespace mpf::bench {
namespace {

using PeerMaker = std::function<std::unique_ptr<Peer>()>;

Outcome runAndClean(const Stage& stage, const std::shared_ptr<Peer>& peer,
                    const Workload& workload) {
  auto outcome = stage.run(workload);
  peer->removeTraces();
  return outcome;
}

Outcome roundTrips(const Stage& stage, const std::shared_ptr<Peer>& peer) {
  Workload workload;
  workload.stopsByItself = true;
  workload.server = [peer](const RunContext& context) { peer->serve(context); };
  workload.requester = [peer](const RunContext& context) {
    peer->connect(context);
    timeEach(context, [&] { peer->roundTrip(); });
    context.stop();
    peer->roundTrip();
  };
  return runAndClean(stage, peer, workload);
}

Outcome outstanding(const Stage& stage, const std::shared_ptr<Peer>& peer, int window) {
  Workload workload;
  workload.stopsByItself = true;
  workload.server = [peer](const RunContext& context) { peer->serve(context); };
  workload.requester = [peer, window](const RunContext& context) {
    peer->connect(context);
    for (int i = 0; i < window; ++i) peer->send();
    timeRate(context, 1, [&] {
      peer->receive();
      peer->send();
    });
    for (int i = 0; i < window; ++i) peer->receive();
    context.stop();
    peer->roundTrip();
  };
  return runAndClean(stage, peer, workload);
}

Outcome oneWay(const Stage& stage, const std::shared_ptr<Peer>& peer) {
  Workload workload;
  workload.server = [peer](const RunContext& context) { peer->sink(context); };
  workload.requester = [peer](const RunContext& context) {
    timeOneWay(context, [&](const std::function<bool()>& resume) { peer->flood(context, resume); });
  };
  return runAndClean(stage, peer, workload);
}

std::string sizeText(std::size_t bytes) {
  if (bytes >= 1u << 20) return std::to_string(bytes >> 20) + " MiB";
  if (bytes >= 1u << 10) return std::to_string(bytes >> 10) + " KiB";
  return std::to_string(bytes) + " B";
}

// Creates the rows of a run; the caller fills in what is special to a row.
class Asker {
 public:
  explicit Asker(std::string runName) : runName_(std::move(runName)) {}

  Measurement row(const PeerFamily& family, const std::string& question, Mode mode,
                  std::size_t bytes, bool touched) {
    Measurement row;
    row.question = question;
    row.name = family.name;
    row.mode = mode;
    row.bytes = bytes;
    row.touched = touched;
    row.skipped = family.skipped;
    row.environment = family.start;
    row.environmentName = family.start ? family.name : "";
    const bool copies = touched;
    row.floorName = copies ? (mode == Mode::block ? kFutexMemcpyBounce : kMemcpyBounce)
                           : (mode == Mode::block ? kFutexBounce : kBounce);
    row.floorBytes = copies ? bytes : 4;
    return row;
  }
  // The function that measures a row: `ask` for a class, `task` for a program.
  template <class Ask>
  std::function<Outcome(const Stage&)> runner(const PeerFamily& family, const Measurement& row,
                                              const Ask& ask, const ExternalTask& task) {
    PeerOptions options{row.mode, row.bytes, row.touched, runName_ + "-" + std::to_string(++made_)};
    if (family.make) {
      return [make = family.make, options, ask](const Stage& stage) {
        return ask(stage, std::shared_ptr<Peer>(make(options)));
      };
    }
    if (!family.program) return {};
    return [program = family.program, options, task](const Stage& stage) {
      return runExternal(stage, *program, task, options);
    };
  }

 private:
  std::string runName_;
  int made_ = 0;
};

std::vector<PeerFamily> families() {
  return {mpfPeer(),
          boostPeer(),
          socketPeer(),
          zeromqPeer(),
          iceoryxPeer(),
          iceoryx2Peer(),
          iceoryx2PublishingPeer(),
          aeronPeer(),
          aeronClientPeer()};
}

// A family that is not installed has only one row for each question.
std::vector<Mode> modesOf(const PeerFamily& family) {
  return family.skipped.empty() ? family.modes : std::vector{family.modes.front()};
}

}  // namespace

std::vector<Measurement> peerMeasurements(const std::string& runName) {
  Asker asker(runName);
  std::vector<Measurement> rows;
  const auto all = families();
  const auto add = [&](const PeerFamily& family, Measurement row, const auto& ask,
                       const ExternalTask& task) {
    row.run = asker.runner(family, row, ask, task);
    rows.push_back(std::move(row));
  };

  for (const std::size_t bytes :
       {std::size_t{4}, std::size_t{1} << 10, std::size_t{1} << 16, std::size_t{1} << 20}) {
    for (const bool touched : {false, true}) {
      if (touched && bytes == 4) continue;  // an Int32 is always written and read
      const auto question =
          bytes == 4 ? std::string(kSmallRoundTrip)
                     : "Round trip of " + sizeText(bytes) +
                           (touched ? ", every byte written and read both ways" : ", untouched");
      for (const auto& family : all) {
        for (const auto mode : modesOf(family)) {
          add(family, asker.row(family, question, mode, bytes, touched), roundTrips, {});
        }
      }
    }
  }
  auto oneWayFamilies = all;
  std::erase_if(oneWayFamilies,
                [](const auto& family) { return !family.oneWay && family.skipped.empty(); });
  oneWayFamilies.insert(oneWayFamilies.begin() + 1, {mpfBatchPeer(false), mpfBatchPeer(true)});
  for (const auto& family : oneWayFamilies) {
    for (const auto mode : modesOf(family)) {
      auto row = asker.row(family, "One way, 4 B", mode, 4, false);
      row.floorName = kRing;
      add(family, std::move(row), oneWay, {"one-way"});
    }
  }
  auto outstandingFamilies = all;
  outstandingFamilies.insert(outstandingFamilies.begin() + 1, mpfRunPeer());
  for (const int window : {1, 10, 100}) {
    for (const auto& family : outstandingFamilies) {
      for (const auto mode : modesOf(family)) {
        auto row = asker.row(
            family, "Requests and replies of 4 B with " + std::to_string(window) + " outstanding",
            mode, 4, false);
        row.detail = std::to_string(window) + " outstanding";
        if (row.skipped.empty() && window > family.maxOutstanding)
          row.skipped = "holds at most " + std::to_string(family.maxOutstanding);
        add(family, std::move(row),
            [window](const Stage& stage, const auto& peer) {
              return outstanding(stage, peer, window);
            },
            {"outstanding", window});
      }
    }
  }
  return rows;
}

}  // namespace mpf::bench
