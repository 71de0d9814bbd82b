// SPDX-License-Identifier: MIT
// mpf top: shows servers, clients, links and connections to other hosts of a backplane, live on a
// terminal, or prints them a number of times.
#include <poll.h>
#include <sys/eventfd.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <array>
#include <fmt/format.h>
#include <memory>
#include <thread>

#include <mpf/backplane.h>
#include <mpf/file_descriptor.h>

#include "base/command_line.h"
#include "base/print_error.h"
#include "base/stop_signals.h"
#include "base/system_call.h"
#include "tools/arguments.h"
#include "tools/commands.h"
#include "tools/report/screen.h"

namespace mpf::tools {
namespace {

// The longest wait for the first rates. Rates of a shorter interval would mean little.
constexpr auto kFirstInterval = std::chrono::milliseconds(200);

struct TopArguments {
  std::string backplane;
  Nanoseconds interval = std::chrono::seconds(1);
  int batch = 0;
  bool clients = false;
  bool routers = false;
  std::string sort;
  std::string filter;
};

// Takes a snapshot each time; the previous snapshot is the first one of the delta.
class SnapshotSeries {
 public:
  explicit SnapshotSeries(std::string backplane)
      : backplane_(std::move(backplane)), last_(Snapshot::take(backplane_)) {}
  std::shared_ptr<const SnapshotDelta> next() {
    auto now = Snapshot::take(backplane_);
    auto delta = std::make_shared<const SnapshotDelta>(std::move(last_), now);
    last_ = std::move(now);
    return delta;
  }

 private:
  std::string backplane_;
  Snapshot last_;
};

// Applies the options, after the view has its first table. False when the column for --sort does
// not exist.
bool prepare(TopView& view, const TopArguments& arguments) {
  if (arguments.clients) view.showClients();
  if (arguments.routers) view.showRouters();
  view.setFilter(arguments.filter);
  if (arguments.sort.empty() || view.trySortBy(arguments.sort)) return true;
  printError("mpf top: no column \"{}\"; the heading of `mpf top --batch 1` shows all columns\n",
             arguments.sort);
  return false;
}

int printBatch(const TopArguments& arguments) {
  SnapshotSeries series(arguments.backplane);
  TopView view;
  view.show(series.next());
  if (!prepare(view, arguments)) return 2;  // before the first pause
  for (int i = 0; i < arguments.batch; ++i) {
    std::this_thread::sleep_for(arguments.interval);
    view.show(series.next());
    if (i != 0) fmt::print("\n");
    for (const auto& line : view.lines(0)) fmt::print("{}\n", line.text);
    std::fflush(stdout);
  }
  return 0;
}

// A descriptor that becomes readable on SIGINT or SIGTERM.
class StopEvent {
 public:
  [[nodiscard]] int descriptor() const noexcept { return event_.get(); }

 private:
  static void set(void* event) noexcept { ::eventfd_write(*static_cast<int*>(event), 1); }
  FileDescriptor event_{checkCall(::eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK), "eventfd")};
  int number_ = event_.get();
  StopSignals signals_{set, &number_};
};

int showLive(const TopArguments& arguments) {
  const StopEvent stop;  // before ncurses, which does not replace handlers that already exist
  TopView view;
  SnapshotSeries series(arguments.backplane);
  std::this_thread::sleep_for(std::min<Nanoseconds>(arguments.interval, kFirstInterval));
  view.show(series.next());
  if (!prepare(view, arguments)) return 2;
  Screen screen;
  auto due = Deadline::after(arguments.interval);
  for (;;) {
    screen.draw(view.lines(screen.rows()));
    std::array<pollfd, 2> ready{{{STDIN_FILENO, POLLIN, 0}, {stop.descriptor(), POLLIN, 0}}};
    const auto left = std::chrono::ceil<std::chrono::milliseconds>(due.left()).count();
    ::poll(ready.data(), ready.size(), static_cast<int>(std::min<std::int64_t>(left, 3'600'000)));
    if (ready[1].revents != 0 || (ready[0].revents & (POLLHUP | POLLERR)) != 0) return 0;
    while (const auto key = screen.tryKey()) {
      if (!view.handle(*key)) return 0;
    }
    if (!due.hasPassed()) continue;
    view.show(series.next());
    due = Deadline::after(arguments.interval);
  }
}

}  // namespace

void addTop(CLI::App& app, Run& run) {
  auto& command = *app.add_subcommand("top",
                                      "Shows servers, clients, links and connections to other "
                                      "hosts live: rates, queues, latencies, stalls");
  auto arguments = std::make_shared<TopArguments>();
  addBackplane(command, arguments->backplane, "\"default\"");
  addTime(command, "--interval", arguments->interval, "Time between two snapshots", kAboveZero);
  command
      .add_option("--batch", arguments->batch,
                  "Print the table this number of times, without a live screen")
      ->check(wholeNumber(1, 1'000'000'000));
  auto* clients = command.add_flag("--clients", arguments->clients, "Show the clients first");
  command.add_flag("--routers", arguments->routers, "Show the connections to other hosts first")
      ->excludes(clients);
  command.add_option("--sort", arguments->sort, "Heading of the column to sort by");
  command.add_option("--filter", arguments->filter, "Show only rows that contain this text");
  command.footer(std::string("Keys: ") + TopView::kKeys + "; arrows, j, k, PgUp, PgDn select.");
  command.callback([arguments, &run] {
    run = [arguments] {
      arguments->backplane = Backplane::named(arguments->backplane).name();
      return arguments->batch != 0 ? printBatch(*arguments) : showLive(*arguments);
    };
  });
}

}  // namespace mpf::tools
