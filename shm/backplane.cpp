// SPDX-License-Identifier: MIT
#include <mpf/backplane.h>

#include <cstdlib>
#include <fmt/format.h>
#include <set>
#include <stdexcept>
#include <utility>

#include "base/number.h"
#include "base/printable.h"
#include "base/step.h"
#include "shm/per_process.h"
#include "shm/segment.h"
#include "shm/segment_name.h"
#include "shm/stale_segments.h"
#include "shm/watcher.h"

namespace mpf {

struct Backplane::State {
  explicit State(std::string itsName) : name(std::move(itsName)) {
    static_cast<void>(watcher.get(name));  // here, where the caller expects errors
  }
  std::string name;
  PerProcess<Watcher> watcher;  // the parent's watcher has no thread in the child of a fork
};

namespace {

std::string environmentOr(const char* variable, const char* otherwise) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0' ? value : otherwise;
}

// Number of files that attach() examines, which limits its time. If a backplane has no more files
// than this, attach() removes all files of dead processes; otherwise it examines a random choice of
// them (docs/decisions/0038-short-attach.md says why this is enough). `mpf clean` always examines
// all files.
constexpr std::size_t kMaxFilesPerAttach = 1024;

std::vector<std::string> removeAll(std::vector<stale_segments::Judged> judged) {
  MPF_STEP(stale_scan_begun);
  std::vector<std::string> removed;
  for (auto& file : judged) {
    if (stale_segments::tryRemove(file)) removed.push_back(std::move(file.name));
  }
  return removed;
}

}  // namespace

Backplane::Backplane(std::string name) : state_(std::make_shared<State>(std::move(name))) {}

Backplane Backplane::named(const std::string& name) {
  auto chosen = name.empty() ? environmentOr("MPF_BACKPLANE", "default") : name;
  SegmentName::checkBackplane(chosen);
  return Backplane(std::move(chosen));
}

Backplane Backplane::attach(const std::string& name) {
  auto backplane = named(name);
  static_cast<void>(removeAll(stale_segments::judgeSome(backplane.name(), kMaxFilesPerAttach)));
  return backplane;
}

Backplane Backplane::isolated() {
  return Backplane(fmt::format("isolated-{:x}", segments::newIncarnation()));
}

const std::string& Backplane::name() const noexcept { return state_->name; }
Watcher& Backplane::watcher() const { return state_->watcher.get(state_->name); }

std::int32_t Backplane::defaultLocation() {
  const auto text = environmentOr("MPF_LOCATION", "0");
  if (const auto location = tryNumber<std::int32_t>(text)) return *location;
  throw std::invalid_argument(fmt::format("MPF_LOCATION \"{}\": use an integer", printable(text)));
}

std::vector<std::string> Backplane::segmentNames() const {
  return segments::list(SegmentName::prefix(name()));
}

std::vector<std::string> Backplane::names() {
  std::set<std::string> names;
  for (const auto& segment : segments::list(SegmentName::prefix({}))) {
    if (const auto parsed = SegmentName::tryParse(segment)) names.insert(parsed->backplane);
  }
  return {names.begin(), names.end()};
}

std::vector<std::string> Backplane::removeDead() const {
  return removeAll(stale_segments::judge(name()));
}

}  // namespace mpf
