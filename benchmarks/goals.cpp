// SPDX-License-Identifier: MIT
// The goals that the project has set itself, and how far a run is from them.
#include <algorithm>
#include <fmt/format.h>
#include <optional>

#include <mpf/benchmarks/mpf_peer.h>
#include <mpf/benchmarks/report.h>

namespace mpf::bench {
namespace {

class Goals {
 public:
  explicit Goals(const std::vector<Result>& results) : results_(results) {}

  // The good row with these marks, or nullptr. `question` is how its heading begins.
  [[nodiscard]] const Result* find(std::string_view question, std::string_view name, Mode mode) const {
    const auto found = std::find_if(results_.begin(), results_.end(), [&](const Result& result) {
      const auto& what = result.measurement;
      return result.isGood() && what.question.starts_with(question) && what.name == name && what.mode == mode;
    });
    return found == results_.end() ? nullptr : &*found;
  }
  [[nodiscard]] std::optional<double> ratioToFloor(std::string_view question, Mode mode) const {
    const auto* row = find(question, kMpf, mode);
    return row != nullptr && row->ratioToFloor > 0 ? std::optional(row->ratioToFloor) : std::nullopt;
  }
  // How much more one costs than the other; both were measured beside the same floor, each in its own minute.
  [[nodiscard]] std::optional<double> costRatio(const Result* row, const Result* to) const {
    const bool known = row != nullptr && to != nullptr && row->ratioToFloor > 0 && to->ratioToFloor > 0;
    return known ? std::optional(row->ratioToFloor / to->ratioToFloor) : std::nullopt;
  }

  void atMost(std::string_view goal, std::optional<double> reached, double limit) {
    add(goal, reached, limit, reached && *reached <= limit);
  }
  void atLeast(std::string_view goal, std::optional<double> reached, double limit) {
    add(goal, reached, limit, reached && *reached >= limit);
  }
  [[nodiscard]] std::string text() const { return text_; }

 private:
  void add(std::string_view goal, std::optional<double> reached, double limit, bool good) {
    if (reached) text_ += fmt::format("  {:<66} {:>9.2f} {:>9.2f}  {}\n", goal, limit, *reached, good ? "reached" : "MISSED");
  }
  const std::vector<Result>& results_;
  std::string text_;
};

}  // namespace

std::string goals(const std::vector<Result>& results) {
  Goals goals(results);
  const std::string idle = "Round trip of 4 B beside";
  const auto* small = goals.find("Round trip of 4 B", kMpf, Mode::spin);
  goals.atMost("Int32 round trip, polling, x cache-line bounce, at most", goals.ratioToFloor("Round trip of 4 B", Mode::spin), 1.4);
  goals.atMost("Int32 round trip, asleep, x futex bounce, at most", goals.ratioToFloor("Round trip of 4 B", Mode::block), 1.15);
  if (const auto* row = goals.find("One way", kMpf, Mode::spin))
    goals.atLeast("Int32 one way, million a second, at least", row->figures.perSecond / 1e6, 40);
  goals.atMost("1 MiB untouched, polling, x Int32 round trip, at most",
               goals.costRatio(goals.find("Round trip of 1 MiB, untouched", kMpf, Mode::spin), small), 2);
  goals.atMost("1 MiB touched, polling, x memcpy bounce, at most", goals.ratioToFloor("Round trip of 1 MiB, every", Mode::spin), 1.3);
  for (const auto mode : {Mode::spin, Mode::block}) {
    const auto ratio = goals.costRatio(goals.find(idle, "MPF, 10000 idle", mode), goals.find(idle, "MPF, 1 idle", mode));
    goals.atMost(fmt::format("Round trip beside 10000 idle clients, {}, x beside one, at most", toString(mode)), ratio, 1.1);
  }
  if (const auto* row = goals.find("Connect", kMpf, Mode::adaptive)) goals.atMost("Connect [us], at most", row->costNs() / 1e3, 200);
  if (const auto* row = goals.find("CPU of 100", kMpf, Mode::adaptive))
    goals.atMost("CPU of 100 idle processes [% of one CPU], at most", row->figures.value, 0.1);
  return goals.text().empty() ? "" : fmt::format("\n{:<68} {:>9} {:>9}\n", "Goals", "goal", "reached") + goals.text();
}

}  // namespace mpf::bench
