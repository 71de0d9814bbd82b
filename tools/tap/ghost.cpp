// SPDX-License-Identifier: MIT
#include "tools/tap/ghost.h"

#include <cstdio>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "base/print_error.h"
#include "base/stop_signals.h"
#include "tools/tap/ghost_server.h"
#include "tools/tap/reader_watch.h"
#include "tools/text/json_text.h"
#include "tools/text/wrap.h"

namespace mpf::tools {
namespace {

constexpr int kOneLine = -1;

void announce(const GhostOptions& options, const std::string& name, const GhostScript& script) {
  if (options.json) {
    const nlohmann::json tree{
        {"server", name}, {"location", options.location}, {"recorded_requests", script.requests()}};
    fmt::print("{}\n", jsonText(tree, kOneLine));
  } else {
    fmt::print("\"{}\" at location {} replies as in {}, {}\n", name, options.location, options.file,
               counted(script.requests(), "request"));
  }
  std::fflush(stdout);
}

void report(const GhostCounts& counts, bool asJson) {
  if (asJson) {
    const nlohmann::json tree{{"requests", counts.requests},
                              {"similar", counts.similar},
                              {"unknown", counts.unknown},
                              {"silent", counts.silent},
                              {"replies", counts.replies}};
    return fmt::print("{}\n", jsonText(tree, kOneLine));
  }
  fmt::print("{}, {} by the replies to a similar one, {} refused as unknown, {} not answered; {}\n",
             counted(counts.requests, "request"), counts.similar, counts.unknown, counts.silent,
             counts.replies == 1 ? "1 reply" : fmt::format("{} replies", counts.replies));
}

}  // namespace

int serveGhost(const GhostOptions& options) {
  GhostScript script(options.file);
  if (script.missed() > 0)
    printError("mpf replay: {} of {} are missing, so some requests are not answered fully\n",
               counted(script.missed(), "message"), options.file);
  const auto& name = options.server.empty() ? script.server() : options.server;
  GhostServer ghost(Backplane::attach(options.backplane), name, {.location = options.location},
                    script, options.speed);
  const StopSignals stop([](void* self) noexcept { static_cast<GhostServer*>(self)->stop(); },
                         &ghost);
  const ReaderWatch reader([&ghost] { ghost.stop(); });
  announce(options, name, script);
  ghost.run();
  report(ghost.counts(), options.json);
  return 0;
}

}  // namespace mpf::tools
