// SPDX-License-Identifier: MIT
// The peers that are programs of their own. scripts/bench-peers builds them into the folder
// mpf-bench-peers beside mpf-bench.
#include <filesystem>

#include "base/program_beside.h"
#include "benchmarks/peers/external_peer.h"

namespace mpf::bench {
namespace {

std::string peerFile(const std::string& name) { return programBeside("mpf-bench-peers/" + name); }

//   file  must exist, otherwise the rows are left out
PeerFamily externalPeer(std::string name, std::vector<Mode> modes, const std::string& file,
                        ExternalProgram program) {
  PeerFamily family;
  family.name = std::move(name);
  family.modes = std::move(modes);
  family.oneWay = true;
  if (!std::filesystem::exists(file))
    family.skipped = "not built (make bench-peers, after scripts/setup bench)";
  family.program = std::make_shared<const ExternalProgram>(std::move(program));
  return family;
}

// The options of the JVM are those of Aeron's own scripts (run-java, ping, pong) with two changes.
// The serial collector has no threads that could use the CPU of a polling thread; nothing is
// collected on the way of a message. Compiling in the background needs the same CPU, therefore the
// long warm-up.
std::vector<std::string> aeronCommand() {
  return {"java",
          "-XX:+UnlockExperimentalVMOptions",
          "-XX:+TrustFinalNonStaticFields",
          "-XX:+UnlockDiagnosticVMOptions",
          "-XX:GuaranteedSafepointInterval=300000",
          "-XX:+UseSerialGC",
          "-XX:-UsePerfData",
          "-Xms64m",
          "-Xmx256m",
          "-Dagrona.disable.bounds.checks=true",
          "-Daeron.pre.touch.mapped.memory=true",
          "-Daeron.term.buffer.sparse.file=false",
          "--add-opens=java.base/jdk.internal.misc=ALL-UNNAMED",
          "-cp",
          peerFile("aeron/aeron-all.jar") + ":" + peerFile("aeron"),
          "AeronPeer"};
}

}  // namespace

PeerFamily iceoryx2Peer() {
  const auto file = peerFile("mpf-bench-iceoryx2");
  auto family =
      externalPeer("iceoryx2", {Mode::spin, Mode::block}, file, {{file, "request-response"}, {}});
  family.oneWay = false;
  return family;
}

PeerFamily iceoryx2PublishingPeer() {
  const auto file = peerFile("mpf-bench-iceoryx2");
  return externalPeer("iceoryx2 pub-sub", {Mode::spin, Mode::block}, file,
                      {{file, "publish-subscribe"}, {}});
}

PeerFamily aeronPeer() {
  return externalPeer("Aeron (Java)", {Mode::spin}, peerFile("aeron/AeronPeer.class"),
                      {aeronCommand(), std::chrono::milliseconds(1000)});
}

}  // namespace mpf::bench
