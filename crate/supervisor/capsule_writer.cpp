// SPDX-License-Identifier: MIT
#include "crate/supervisor/capsule_writer.h"

#include <exception>
#include <filesystem>

#include "base/print_error.h"
#include "crate/capsule/capsule.h"

namespace mpf::crate {
namespace {

Cause causeOf(const Service& service, const ProcessEnd& end) {
  auto cause = end.waitStatus ? Cause::ofWaitStatus(*end.waitStatus) : Cause();
  if (service.endReason() == EndReason::stalled) cause.kind = CauseKind::stalled;
  if (service.endReason() == EndReason::busy) cause.kind = CauseKind::busy;
  if (service.endReason() == EndReason::restartRequest) cause.kind = CauseKind::restarted;
  return cause;
}

}  // namespace

void CapsuleWriter::addTo(std::vector<pollfd>& polled) const {
  for (const auto& [backplane, witness] : witnesses_)
    polled.push_back({witness.descriptor(), POLLIN, 0});
}

void CapsuleWriter::look() {
  for (auto& [backplane, witness] : witnesses_) witness.look();
}

void CapsuleWriter::watch(const Service& service) {
  const auto& backplane = service.plan().backplane;
  if (backplane.empty()) return;  // a process that is no longer in the crate
  auto& witness = witnesses_.try_emplace(backplane, backplane).first->second;
  witness.watch(service.pid(), service.startTicks());
}

void CapsuleWriter::forget(const Service& service) {
  const auto found = witnesses_.find(service.plan().backplane);
  if (found != witnesses_.end()) found->second.forget(service.pid());
}

std::string CapsuleWriter::collect(const Service& service, const ProcessEnd& end) {
  std::string path;
  try {
    if (service.endReason() != EndReason::stopRequest && !service.isRepeatedFailure(end))
      path = write(service, end);
  } catch (const std::exception& error) {
    printError("mpf run: {}: cannot write a capsule: {}\n", service.plan().name, error.what());
  }
  forget(service);
  return path;
}

// Returns the path of the capsule; empty if the process is no longer in the crate.
std::string CapsuleWriter::write(const Service& service, const ProcessEnd& end) {
  const auto& plan = service.plan();
  const auto found = witnesses_.find(plan.backplane);
  if (found == witnesses_.end()) return {};
  Death death;
  death.crate = crate_;
  death.process = plan.name;
  death.command = plan.command;
  death.pid = service.pid();
  death.startedNs = service.startedNs();
  death.restarts = service.restarts();
  death.cause = causeOf(service, end);
  death.log = folder_.log(plan.name);
  death.folder =
      plan.workingFolder.empty() ? std::filesystem::current_path().string() : plan.workingFolder;
  return store_.add(capsuleOf(death, found->second.find(service.pid())));
}

}  // namespace mpf::crate
