// SPDX-License-Identifier: MIT
#include "shm/stale_segments.h"

#include <algorithm>
#include <fmt/format.h>
#include <limits>
#include <map>
#include <optional>
#include <random>
#include <set>

#include "base/step.h"
#include "shm/owner_lock.h"
#include "shm/segment.h"
#include "shm/segment_name.h"

namespace mpf::stale_segments {
namespace {

// The verdict about one file. The verdict about a window also applies to the files of the window.
struct Finding {
  Verdict verdict{};
  std::string reason;
};

std::string ownerText(const layout::SegmentHeader& header) {
  return fmt::format("pid {} ({})", header.ownerPid, segments::text(header.program));
}

// For a file that has its own lock, and a name that no other file will ever have: the lock alone
// decides.
Finding judgeKeyed(const std::string& name) {
  switch (segments::probeOwner(name)) {
    case segments::Owner::alive:
      return {Verdict::alive, fmt::format("the lock of {} is held", name)};
    case segments::Owner::dead:
      if (segments::isLocked(name))
        return {Verdict::dead,
                fmt::format("its owner has ended; another process holds a lock on {}", name)};
      return {Verdict::dead, fmt::format("no process holds the lock of {}", name)};
    case segments::Owner::absent:
      break;
  }
  return {Verdict::dead, "its name no longer exists"};
}

// Whether the hints of a client window are of this version of the layout: then the window is, too,
// and a header that says otherwise is invalid.
bool hasHintsOfThisVersion(const std::string& window) noexcept try {
  const auto parsed = SegmentName::tryParse(window);
  return parsed && segments::tryReadHeader(
                       SegmentName::keyed(parsed->backplane, NameKind::hints, parsed->incarnation),
                       layout::SegmentKind::hints);
} catch (const std::exception&) {
  return false;
}

// For a window. A free lock proves nothing unless the file is a segment of a known version, or its
// name contains an incarnation.
//   window  what was found, if the file is a window of a known version
Finding judgeWindow(const std::string& name, layout::SegmentKind kind,
                    std::optional<segments::Probed>& window) try {
  window = segments::tryProbe(name, kind);
  if (!window) return {Verdict::dead, "its name no longer exists"};
  const auto owner = ownerText(window->header);
  if (window->hasOwner)
    return {Verdict::alive, fmt::format("{} holds the lock of {}", owner, name)};
  if (window->isLocked)
    return {Verdict::dead,
            fmt::format("{} has ended; another process holds a lock on {}", owner, name)};
  return {Verdict::dead,
          fmt::format("no process holds the lock of {}; its owner was {}", name, owner)};
} catch (const VersionError& error) {
  if (kind == layout::SegmentKind::clientWindow && hasHintsOfThisVersion(name))
    return judgeKeyed(name);
  return {Verdict::unknown, fmt::format("cannot be judged: {}", error.what())};
} catch (const SegmentError& error) {
  if (kind == layout::SegmentKind::clientWindow) return judgeKeyed(name);
  return {Verdict::unknown, fmt::format("cannot be judged: {}", error.what())};
} catch (const std::exception& error) {
  return {Verdict::unknown, fmt::format("cannot be judged: {}", error.what())};
}

class Judge {
 public:
  //   most   judges so many files, chosen at random, if there are more
  Judge(std::string backplane, std::size_t most) : backplane_(std::move(backplane)), most_(most) {}

  std::vector<Judged> run() {
    std::vector<File> files;
    std::vector<std::string> others;
    for (auto& name : segments::list(SegmentName::prefix(backplane_))) {
      auto parsed = SegmentName::tryParse(name);
      if (!parsed) {
        others.push_back(std::move(name));
        continue;
      }
      if (parsed->kind == NameKind::link) ++listedLinks_[parsed->incarnation];
      files.emplace_back(std::move(name), *std::move(parsed));
    }
    const bool isChoice = files.size() + others.size() > most_;
    if (files.size() > most_) choose(files);
    for (const auto step : {&Judge::withLock, &Judge::hints, &Judge::ofWindow, &Judge::last}) {
      for (const auto& [name, parsed] : files) (this->*step)(name, parsed);
    }
    for (const auto& name : others) {
      if (!isChoice) add(name, {Verdict::unknown, "not a name that MPF gives"});
    }
    return std::move(judged_);
  }

 private:
  using Parsed = SegmentName::Parsed;
  using File = std::pair<std::string, Parsed>;
  struct DeadWindow {
    std::string name;
    std::optional<std::uint32_t> user;  // that owned its file
  };

  // The links with one incarnation that were judged. Any user may create a second one, of another
  // server, so their pools are dead only if all of them are.
  struct Links {
    std::size_t count = 0;
    Finding finding;
  };

  void choose(std::vector<File>& files) const {
    std::ranges::shuffle(files, std::minstd_rand(std::random_device()()));
    files.erase(files.begin() + static_cast<std::ptrdiff_t>(most_), files.end());
  }

  void add(const std::string& name, Finding finding) {
    judged_.push_back({name, finding.verdict, std::move(finding.reason)});
  }

  void withLock(const std::string& name, const Parsed& parsed) {
    std::optional<segments::Probed> window;
    if (parsed.kind == NameKind::serverWindow) {
      auto finding = judgeWindow(name, layout::SegmentKind::serverWindow, window);
      if (window) servers_.insert(window->header.incarnation);
      if (finding.verdict == Verdict::dead && window && isAtItsName(name, window->header))
        deadWindows_.emplace(window->header.incarnation, DeadWindow{name, window->user});
      add(name, std::move(finding));
    } else if (parsed.kind == NameKind::clientWindow) {
      const auto& finding = clients_[parsed.incarnation] =
          judgeWindow(name, layout::SegmentKind::clientWindow, window);
      if (finding.verdict == Verdict::dead) {
        const auto user = window ? window->user : segments::userOf(name);
        deadWindows_.emplace(parsed.incarnation, DeadWindow{name, user});
      }
      add(name, finding);
    } else if (parsed.kind == NameKind::router || parsed.kind == NameKind::reaper) {
      add(name, judgeKeyed(name));
    }
  }

  // Otherwise the file is a copy of the window of another server, which may be alive.
  [[nodiscard]] bool isAtItsName(const std::string& name,
                                 const layout::SegmentHeader& header) const {
    return name ==
           SegmentName::serverWindow(backplane_, header.location, segments::rawText(header.name));
  }

  void hints(const std::string& name, const Parsed& parsed) {
    if (parsed.kind == NameKind::hints)
      add(name, hints_[parsed.incarnation] = judgeHints(name, parsed.incarnation));
  }

  // Hints are dead if their window is dead, because every peer may overwrite the header of hints
  // and lock them. A window of another user is no evidence: any user may create a window with the
  // incarnation of these hints.
  Finding judgeHints(const std::string& name, std::uint64_t incarnation) const {
    const auto [first, last] = deadWindows_.equal_range(incarnation);
    const auto user = first == last ? std::nullopt : segments::userOf(name);
    const auto isTheirs = [&](const auto& window) { return user && window.second.user == user; };
    if (const auto window = std::find_if(first, last, isTheirs); window != last)
      return {Verdict::dead, fmt::format("the owner of {} is dead", window->second.name)};
    return judgeKeyed(name);
  }

  void ofWindow(const std::string& name, const Parsed& parsed) {
    if (parsed.kind == NameKind::pendingBind)
      add(name, judgeOwned(name, layout::SegmentKind::pendingBind, false));
    if (parsed.kind != NameKind::link) return;
    auto finding =
        judgeOwned(name, layout::SegmentKind::link, servers_.contains(parsed.serverWindow));
    auto& links = links_[parsed.incarnation];
    if (links.count++ == 0 || links.finding.verdict == Verdict::dead) links.finding = finding;
    add(name, std::move(finding));
  }

  // For a link or a pending bind: it is dead if the window of its client is dead.
  //   isOurs  its server uses this version of the layout, so a header of another one is invalid
  Finding judgeOwned(const std::string& name, layout::SegmentKind kind, bool isOurs) try {
    const auto header = segments::tryReadHeader(name, kind);
    if (!header) return {Verdict::dead, "its name no longer exists"};
    return ownerOf(clients_, NameKind::clientWindow, header->ownerWindow);
  } catch (const VersionError& error) {
    if (isOurs) return {Verdict::dead, fmt::format("no program can use it: {}", error.what())};
    return {Verdict::unknown, fmt::format("cannot be judged: {}", error.what())};
  } catch (const SegmentError& error) {
    return {Verdict::dead, fmt::format("no program can use it: {}", error.what())};
  } catch (const std::exception& error) {
    return {Verdict::unknown, fmt::format("cannot be judged: {}", error.what())};
  }

  // A pool belongs to its link; a FIFO and the fan-out pool to a window, whose hints were judged.
  // A pool whose link exists, but was not chosen, is not judged.
  void last(const std::string& name, const Parsed& parsed) {
    if (parsed.kind == NameKind::bulk) {
      const auto listed = listedLinks_.find(parsed.incarnation);
      if (listed == listedLinks_.end())
        add(name, {Verdict::dead, fmt::format("its link {:x} is gone", parsed.incarnation)});
      else if (const auto& links = links_[parsed.incarnation]; links.count == listed->second)
        add(name, links.finding);
    } else if (parsed.kind == NameKind::fifo || parsed.kind == NameKind::fanOut) {
      add(name, ownerOf(hints_, NameKind::hints, parsed.incarnation));
    }
  }

  // The verdict about an owner. An owner that was not listed may have started after the listing.
  // Then the lock of its window or of its hints decides.
  const Finding& ownerOf(std::map<std::uint64_t, Finding>& known, NameKind kind,
                         std::uint64_t incarnation) const {
    const auto [found, isNew] = known.try_emplace(incarnation);
    if (!isNew) return found->second;
    const auto name = SegmentName::keyed(backplane_, kind, incarnation);
    found->second = {Verdict::dead, fmt::format("its owner's {} is gone", name)};
    for (const auto& lock : {name, SegmentName::keyed(backplane_, NameKind::hints, incarnation)}) {
      if (segments::probeOwner(lock) != segments::Owner::alive) continue;
      found->second = {Verdict::alive, fmt::format("the lock of {} is held", lock)};
      break;
    }
    return found->second;
  }

  std::string backplane_;
  std::size_t most_;
  std::set<std::uint64_t> servers_;  // incarnations of windows of this version of the layout
  // by incarnation: the number of links, also of those that were not chosen
  std::map<std::uint64_t, std::size_t> listedLinks_;
  std::map<std::uint64_t, Finding> clients_;  // by the incarnation of the window
  std::multimap<std::uint64_t, DeadWindow> deadWindows_;  // likewise
  std::map<std::uint64_t, Finding> hints_;
  std::map<std::uint64_t, Links> links_;  // likewise
  std::vector<Judged> judged_;
};

}  // namespace

std::vector<Judged> judge(const std::string& backplane) {
  return judgeSome(backplane, std::numeric_limits<std::size_t>::max());
}

std::vector<Judged> judgeSome(const std::string& backplane, std::size_t most) {
  return Judge(backplane, most).run();
}

bool tryRemove(const Judged& file) {
  const auto parsed = SegmentName::tryParse(file.name);
  if (file.verdict != Verdict::dead || !parsed) return false;
  switch (parsed->kind) {
    case NameKind::serverWindow:
      // A new server may use this name now: this checks the lock again, and removes the name only
      // while it holds the reaper's lock.
      return segments::removeIfOwnerless(file.name);
    case NameKind::clientWindow:
    case NameKind::router:
      return segments::removeKeyedIfOwnerless(file.name);
    case NameKind::reaper:
      return owner_lock::removeReaperFile(file.name);
    default:
      return segments::remove(file.name);
  }
}

namespace {

// An attach removes what remains when the names cannot be listed.
void removeFanOut(const std::string& backplane, std::uint64_t incarnation) noexcept try {
  for (const auto& name : segments::list(SegmentName::fanOutPrefix(backplane, incarnation)))
    segments::remove(name);
  // NOLINTNEXTLINE(bugprone-empty-catch): no descriptor or no memory
} catch (const std::exception&) {
}

}  // namespace

void removeDeadWindow(const std::string& backplane, const std::string& name,
                      std::uint64_t incarnation) {
  const bool isDead = segments::probeOwner(name, incarnation) == segments::Owner::dead;
  const auto hints = SegmentName::keyed(backplane, NameKind::hints, incarnation);
  const bool ownsHints = isDead && segments::haveSameUser(name, hints);
  if (name == SegmentName::keyed(backplane, NameKind::clientWindow, incarnation)) {
    segments::removeKeyedIfOwnerless(name);
  } else if (isDead) {
    segments::removeIfOwnerless(name);
  }
  MPF_STEP(dead_window_removed);
  // Every peer may lock the hints. Their lock decides only if there is no window to ask.
  if (ownsHints ? segments::remove(hints) : segments::removeKeyedIfOwnerless(hints)) {
    segments::remove(SegmentName::keyed(backplane, NameKind::fifo, incarnation));
    removeFanOut(backplane, incarnation);
  }
}

}  // namespace mpf::stale_segments
