// SPDX-License-Identifier: MIT
#include <mpf/shm/backplane.h>

#include <fcntl.h>

#include <algorithm>
#include <cstdlib>
#include <fmt/format.h>
#include <set>

#include <mpf/shm/segment_name.h>

namespace mpf {

struct Backplane::State {
  explicit State(std::string itsName) : name(std::move(itsName)) {}
  std::string name;
  Watcher watcher;
};

namespace {

std::string environmentOr(const char* variable, const char* otherwise) {
  const char* value = std::getenv(variable);
  return value != nullptr && *value != '\0' ? value : otherwise;
}

// Incarnation of a window, 0 when it cannot be read.
std::uint64_t incarnationOf(const std::string& name, layout::SegmentKind kind) {
  try {
    const auto window = Segment::tryOpen(name, kind, Segment::Access::readOnly);
    return window ? window->header().incarnation : 0;
  } catch (const std::exception&) {
    return 0;
  }
}

struct Survey {
  std::set<std::uint64_t> windows;  // of owners that live
  std::set<std::uint64_t> links;    // of clients that live
  std::vector<std::string> removed;
};

void surveyWindow(const std::string& name, const SegmentName::Parsed& parsed, Survey& survey) {
  const auto kind = parsed.kind == NameKind::serverWindow ? layout::SegmentKind::serverWindow : layout::SegmentKind::clientWindow;
  if (segments::removeIfOwnerless(name)) {
    survey.removed.push_back(name);
  } else {
    survey.windows.insert(parsed.kind == NameKind::clientWindow ? parsed.incarnation : incarnationOf(name, kind));
  }
}

// Links, wishes: owned by a client window. A name that was listed before the windows were surveyed cannot be younger than they are.
bool hasLivingOwner(const std::string& name, layout::SegmentKind kind, const Survey& survey) {
  try {
    const auto segment = Segment::tryOpen(name, kind, Segment::Access::readOnly);
    return !segment || survey.windows.contains(segment->header().ownerWindow);
  } catch (const VersionError&) {
    return true;  // not ours to judge
  } catch (const SegmentError&) {
    return false;  // nobody can use it
  } catch (const std::exception&) {
    return true;  // not ours to judge
  }
}

void surveyDependent(const std::string& name, const SegmentName::Parsed& parsed, Survey& survey) {
  bool keep = true;
  switch (parsed.kind) {
    case NameKind::serverWindow:
    case NameKind::clientWindow:
    case NameKind::bulk:
    case NameKind::fifo:
      return;
    case NameKind::hints:
      if (segments::removeIfOwnerless(name)) survey.removed.push_back(name);
      return;
    case NameKind::wish:
      keep = hasLivingOwner(name, layout::SegmentKind::wish, survey);
      break;
    case NameKind::link:
      keep = hasLivingOwner(name, layout::SegmentKind::link, survey);
      if (keep) survey.links.insert(parsed.incarnation);
      break;
  }
  if (!keep && segments::remove(name)) survey.removed.push_back(name);
}

// What hangs on dependents: bulk on links, pipes on hints, whose lock tells of owners of any version.
void surveyLast(const std::string& name, const SegmentName::Parsed& parsed, Survey& survey) {
  bool keep = true;
  if (parsed.kind == NameKind::bulk) keep = survey.links.contains(parsed.incarnation);
  if (parsed.kind == NameKind::fifo) {
    const auto hints = SegmentName::keyed(parsed.backplane, NameKind::hints, parsed.incarnation);
    keep = segments::probeOwner(hints) == segments::Owner::alive;
  }
  if (!keep && segments::remove(name)) survey.removed.push_back(name);
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
  static_cast<void>(backplane.removeDead());
  return backplane;
}

Backplane Backplane::isolated() { return Backplane(fmt::format("isolated-{:x}", segments::newIncarnation())); }

const std::string& Backplane::name() const noexcept { return state_->name; }
Watcher& Backplane::watcher() const noexcept { return state_->watcher; }

std::int32_t Backplane::defaultLocation() { return std::atoi(environmentOr("MPF_LOCATION", "0").c_str()); }

std::vector<std::string> Backplane::segmentNames() const { return segments::list(SegmentName::prefix(name())); }

std::vector<std::string> Backplane::names() {
  std::set<std::string> names;
  for (const auto& segment : segments::list(SegmentName::prefix({}))) {
    if (const auto parsed = SegmentName::tryParse(segment)) names.insert(parsed->backplane);
  }
  return {names.begin(), names.end()};
}

std::vector<std::string> Backplane::removeDead() const {
  const auto names = segmentNames();
  Survey survey;
  const auto forEach = [&](auto&& look) {
    for (const auto& segment : names) {
      if (const auto parsed = SegmentName::tryParse(segment)) look(segment, *parsed);
    }
  };
  forEach([&](const std::string& segment, const SegmentName::Parsed& parsed) {
    if (parsed.kind == NameKind::serverWindow || parsed.kind == NameKind::clientWindow) surveyWindow(segment, parsed, survey);
  });
  forEach([&](const std::string& segment, const SegmentName::Parsed& parsed) { surveyDependent(segment, parsed, survey); });
  forEach([&](const std::string& segment, const SegmentName::Parsed& parsed) { surveyLast(segment, parsed, survey); });
  return survey.removed;
}

void removeDeadWindow(const std::string& backplane, const std::string& name, std::uint64_t incarnation) {
  if (segments::probeOwner(name, incarnation) == segments::Owner::dead) segments::removeIfOwnerless(name);
  if (segments::removeIfOwnerless(SegmentName::keyed(backplane, NameKind::hints, incarnation))) {
    segments::remove(SegmentName::keyed(backplane, NameKind::fifo, incarnation));
  }
}

}  // namespace mpf
