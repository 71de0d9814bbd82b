// SPDX-License-Identifier: MIT
#include "crate/capsule/segment_witness.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <fmt/format.h>

#include "shm/process.h"
#include "shm/segment.h"
#include "tools/inspect/segment_image.h"

namespace mpf::crate {

using layout::SegmentHeader;
using layout::SegmentKind;
using tools::SegmentImage;

namespace {

FileDescriptor openSegment(const std::string& name) {
  const auto path = segments::path(name);
  return FileDescriptor(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NOFOLLOW | O_NONBLOCK));
}

// The header of an open segment; nullopt when it is not a segment of this kind.
std::optional<SegmentHeader> headerOf(const FileDescriptor& file, const std::string& name,
                                      SegmentKind kind) try {
  if (!file) return std::nullopt;
  return SegmentImage::readOpen(file.get(), segments::path(name), kind, layout::kHeaderBytes)
      .header();
} catch (const std::exception&) {
  return std::nullopt;
}

// Any process may write the pid of another one into the header of its file, but only the user of
// the process can own the file.
bool hasUserOf(const FileDescriptor& file, pid_t pid) {
  struct stat segment{}, process{};
  return ::fstat(file.get(), &segment) == 0 &&
         ::stat(fmt::format("/proc/{}", pid).c_str(), &process) == 0 &&
         segment.st_uid == process.st_uid;
}

bool isRemoved(const FileDescriptor& file) {
  struct stat status{};
  return ::fstat(file.get(), &status) == 0 && status.st_nlink == 0;
}

// Closes links that were removed while their server lived. Returns true if its window was removed,
// too. The process is asked whether it lives after the files were seen without a name: files that
// peers removed because of a death are kept.
bool closeRemovedOf(WitnessedWindow& window) {
  const auto isGone = isRemoved(window.file);
  std::vector<std::uint64_t> removed;
  for (const auto& [incarnation, link] : window.links)
    if (isRemoved(link.file)) removed.push_back(incarnation);
  if (!isGone && removed.empty()) return false;
  const auto header = headerOf(window.file, window.name, SegmentKind::serverWindow);
  if (!header || Process::hasEnded(*header)) return false;
  for (const auto incarnation : removed) window.links.erase(incarnation);
  return isGone;
}

}  // namespace

SegmentWitness::SegmentWitness(std::string backplane, std::size_t maxFiles)
    : backplane_(std::move(backplane)), maxFiles_(maxFiles) {
  SegmentName::checkBackplane(backplane_);
}

void SegmentWitness::watch(pid_t pid, std::uint64_t startTicks) {
  forget(pid);
  processes_[pid].startTicks = startTicks;
  isScanDue_ = true;
}

void SegmentWitness::forget(pid_t pid) { processes_.erase(pid); }

void SegmentWitness::look() {
  closeRemoved();
  auto names = names_.take();
  if (!names || isScanDue_) {
    names = segments::list(SegmentName::prefix(backplane_));
    isScanDue_ = false;
  }
  // A link is opened only after its window, and a bulk segment after its link.
  for (const auto kind : {NameKind::serverWindow, NameKind::link, NameKind::bulk}) {
    for (const auto& name : *names) {
      const auto parsed = SegmentName::tryParse(name);
      if (!parsed || parsed->backplane != backplane_ || parsed->kind != kind) continue;
      if (kind == NameKind::serverWindow) openWindow(name);
      else if (kind == NameKind::link) openLink(name, *parsed);
      else openBulk(name, *parsed);
    }
  }
}

void SegmentWitness::openWindow(const std::string& name) {
  auto file = openSegment(name);
  const auto header = headerOf(file, name, SegmentKind::serverWindow);
  if (!header) return;
  const auto process = processes_.find(header->ownerPid);
  if (process == processes_.end() || process->second.startTicks != header->ownerStartTicks ||
      !hasUserOf(file, header->ownerPid))
    return;
  auto& window = process->second.windows[header->incarnation];
  if (window.file) return;
  window.name = name;
  window.file = std::move(file);
}

void SegmentWitness::openLink(const std::string& name, const SegmentName::Parsed& parsed) {
  auto* const window = findWindow(parsed.serverWindow);
  if (window == nullptr || window->links.contains(parsed.incarnation)) return;
  makeRoom();
  WitnessedLink link{.name = name, .file = openSegment(name), .client = {}, .bulks = {}};
  const auto header = headerOf(link.file, name, SegmentKind::link);
  if (!header || header->serverWindow != parsed.serverWindow) return;
  const auto client = SegmentName::keyed(backplane_, NameKind::clientWindow, header->clientWindow);
  if (const auto its = headerOf(openSegment(client), client, SegmentKind::clientWindow)) {
    link.client = segments::text(its->name);
    if (link.client.empty()) link.client = segments::text(its->program);
    link.clientPid = its->ownerPid;
  }
  window->links.emplace(parsed.incarnation, std::move(link));
  order_.emplace_back(parsed.serverWindow, parsed.incarnation);
}

void SegmentWitness::openBulk(const std::string& name, const SegmentName::Parsed& parsed) {
  const std::pair place(parsed.side, parsed.segment);
  for (auto& [pid, process] : processes_) {
    for (auto& [incarnation, window] : process.windows) {
      const auto link = window.links.find(parsed.incarnation);
      if (link == window.links.end() || link->second.bulks.contains(place)) continue;
      if (files() >= maxFiles_) return;  // a link is worth more than a pool
      if (auto file = openSegment(name)) link->second.bulks.emplace(place, std::move(file));
    }
  }
}

void SegmentWitness::closeRemoved() {
  for (auto& [pid, process] : processes_) {
    for (auto window = process.windows.begin(); window != process.windows.end();)
      window = closeRemovedOf(window->second) ? process.windows.erase(window) : std::next(window);
  }
  std::erase_if(order_, [&](const auto& place) {
    const auto* const window = findWindow(place.first);
    return window == nullptr || !window->links.contains(place.second);
  });
}

void SegmentWitness::makeRoom() {
  while (files() >= maxFiles_ && !order_.empty()) {
    const auto [incarnation, link] = order_.front();
    order_.erase(order_.begin());
    auto* const window = findWindow(incarnation);
    if (window != nullptr && window->links.erase(link) != 0) ++window->linksLeftOut;
  }
}

WitnessedWindow* SegmentWitness::findWindow(std::uint64_t incarnation) {
  for (auto& [pid, process] : processes_) {
    const auto window = process.windows.find(incarnation);
    if (window != process.windows.end()) return &window->second;
  }
  return nullptr;
}

const WitnessedProcess* SegmentWitness::find(pid_t pid) const {
  const auto process = processes_.find(pid);
  return process == processes_.end() ? nullptr : &process->second;
}

std::size_t SegmentWitness::files() const noexcept {
  std::size_t count = 0;
  for (const auto& [pid, process] : processes_) {
    for (const auto& [incarnation, window] : process.windows) {
      ++count;
      for (const auto& [number, link] : window.links) count += 1 + link.bulks.size();
    }
  }
  return count;
}

}  // namespace mpf::crate
