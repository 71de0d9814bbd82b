// SPDX-License-Identifier: MIT
#include "crate/capsule/capsule_text.h"

#include <signal.h>

#include <cstdint>
#include <fmt/format.h>
#include <utility>

#include "base/duration_text.h"
#include "base/printable.h"
#include "tools/text/table.h"

namespace mpf::crate {

using Tree = nlohmann::ordered_json;
using tools::Table;

namespace {

// A member of any JSON; null when it is absent.
const Tree& at(const Tree& tree, const char* key) {
  static const Tree kNull;
  if (!tree.is_object()) return kNull;
  const auto member = tree.find(key);
  return member == tree.end() ? kNull : *member;
}

std::string text(const Tree& value) {
  if (value.is_null()) return "?";
  if (value.is_string()) return printable(value.get_ref<const std::string&>());
  return printable(value.dump(-1, ' ', false, Tree::error_handler_t::replace));
}
std::string text(const Tree& tree, const char* key) { return text(at(tree, key)); }

std::string duration(const Tree& tree, const char* key) {
  const auto& ns = at(tree, key);
  return ns.is_number() ? durationText(ns.get<double>()) : "?";
}

std::string causeText(const Tree& cause) {
  const auto kind = text(cause, "kind");
  if (kind == "signal") return "died by " + text(cause, "name");
  if (kind == "exit") return "ended with exit status " + text(cause, "status");
  if (kind == "stalled") return "stalled and was ended";
  if (kind == "busy") return "was busy for too long and was ended";
  if (kind == "restarted") return "was restarted by request";
  return "ended for an unknown reason";
}

std::string clientText(const Tree& link) {
  return fmt::format("{} pid {}", text(link, "client"), text(link, "clientPid"));
}

// "int32 cmd 3 of client PROGRAM pid 123"
std::string handledText(const Tree& handling) {
  auto what = fmt::format("{} cmd {}", text(handling, "type"), text(handling, "cmd"));
  const auto& candidates = at(handling, "candidates");
  if (!candidates.is_array() || candidates.empty()) return what + " of an unknown client";
  what += " of client " + clientText(candidates.front());
  if (candidates.size() > 1)
    what += fmt::format(", or the same of {} other clients", candidates.size() - 1);
  return what;
}

bool hasProblem(const Tree& tree) { return !at(tree, "problem").is_null(); }

std::string summaryOfHandling(const Tree& capsule) {
  std::string all;
  for (const auto& server : at(capsule, "servers")) {
    if (!at(server, "handling").is_object()) continue;
    all += fmt::format("{} its server \"{}\" handled {}", all.empty() ? ", while" : ", and",
                       text(server, "name"), handledText(at(server, "handling")));
  }
  return all.empty() ? ", while it handled no request" : all;
}

std::string latencyLine(const char* name, const Tree& latency) {
  return fmt::format("  {:<11} {} sampled, median {}, 99 % {}, longest {}\n", name,
                     text(latency, "count"), duration(latency, "p50Ns"), duration(latency, "p99Ns"),
                     duration(latency, "maxNs"));
}

std::string messagesText(const Tree& link, const char* ring, const char* title) {
  const auto& messages = at(at(link, ring), "messages");
  if (!messages.is_array() || messages.empty()) return {};
  Table table({title, "STATE", "REPLIED", "MESSAGE"});
  for (const auto& message : messages) {
    table.add({text(message, "requestId"), text(message, "state"),
               at(message, "answered").is_null() ? "" : text(message, "answered"),
               text(message, hasProblem(message) ? "problem" : "text")});
  }
  return table.fitted("    ");
}

std::string linksText(const Tree& links) {
  std::string all;
  Table table({"CLIENT", ">PID", "STATE", ">SENT", ">TAKEN", ">WAITING", ">NO REPLY", ">REPLIES"});
  for (const auto& link : links) {
    const auto& requests = at(link, "requests");
    table.add({text(link, "client"), text(link, "clientPid"),
               hasProblem(link) ? text(link, "problem") : text(link, "clientState"),
               text(requests, "sent"), text(requests, "taken"), text(requests, "waiting"),
               text(requests, "unanswered"), text(at(link, "replies"), "sent")});
  }
  if (!table.isEmpty()) all += table.text("  ");
  for (const auto& link : links) {
    const auto messages =
        messagesText(link, "requests", "REQUEST") + messagesText(link, "replies", "REPLY TO");
    if (!messages.empty()) all += fmt::format("\n  {}\n{}", clientText(link), messages);
  }
  return all;
}

std::string serverText(const Tree& server) {
  auto all =
      fmt::format("\nserver \"{}\" at location {}", text(server, "name"), text(server, "location"));
  if (hasProblem(server)) return all + ": " + text(server, "problem") + "\n";
  all += '\n';
  const auto& handling = at(server, "handling");
  if (handling.is_object()) {
    all += fmt::format("  handled {}, for at most {}\n", handledText(handling),
                       duration(handling, "forAtMostNs"));
    for (const auto& candidate : at(handling, "candidates"))
      all += "    " + text(at(candidate, "request"), "text") + '\n';
  } else {
    all += "  handled no request\n";
  }
  all += " ";
  for (const auto& counter : at(server, "counters").items())
    all += fmt::format(" {} {}", printable(counter.key()), text(counter.value()));
  all += '\n' + latencyLine("queue wait:", at(server, "queueWait")) +
         latencyLine("service:", at(server, "service"));
  const auto& leftOut = at(server, "linksLeftOut");
  if (leftOut.is_number() && leftOut != 0)
    all += fmt::format("  {} links were not kept open\n", text(leftOut));
  return all + linksText(at(server, "links"));
}

// Why the kernel sent the signal; empty when it is not known.
std::string reasonText(const Tree& cause, const Tree& core) {
  if (!at(core, "code").is_number_integer() || !at(cause, "signal").is_number_integer()) return {};
  const auto code = at(core, "code").get<int>();
  if (code <= 0) return " sent by a process";
  const auto& address = at(core, "address");
  const auto where =
      address.is_number_unsigned() ? fmt::format(" 0x{:x}", address.get<std::uint64_t>()) : "";
  const auto signal = at(cause, "signal").get<int>();
  if (signal == SIGSEGV && code == SEGV_MAPERR) return ": nothing is mapped at" + where;
  if (signal == SIGSEGV && code == SEGV_ACCERR) return ": no right to access" + where;
  if (signal == SIGBUS && code == BUS_ADRERR) return ": no memory behind" + where;
  return fmt::format(": code {} at{}", code, where);
}

std::string frameText(const Tree& frame) {
  const auto& address = at(frame, "address");
  auto all =
      at(frame, "function").is_null()
          ? fmt::format("0x{:x}", address.is_number_unsigned() ? address.get<std::uint64_t>() : 0)
          : text(frame, "function");
  if (!at(frame, "at").is_null()) return all + "  " + text(frame, "at");
  return at(frame, "module").is_null() ? all : all + "  in " + text(frame, "module");
}

std::string coreText(const Tree& capsule) {
  const auto& core = at(capsule, "core");
  if (!core.is_object()) return {};
  if (hasProblem(core)) return fmt::format("\ncore: {}\n", text(core, "problem"));
  const auto& cause = at(capsule, "cause");
  auto all = fmt::format("\ncore {}\n", text(core, "file"));
  auto reason = fmt::format(", which received {}{}", text(cause, "name"), reasonText(cause, core));
  for (const auto& thread : at(core, "threads")) {
    all += fmt::format("  thread {}{}\n", text(thread, "tid"), std::exchange(reason, {}));
    for (const auto& frame : at(thread, "frames")) all += "    " + frameText(frame) + '\n';
  }
  return all;
}

std::string logText(const Tree& log) {
  if (!log.is_object()) return {};
  if (hasProblem(log))
    return fmt::format("\nlog {}: {}\n", text(log, "file"), text(log, "problem"));
  const auto& lines = at(log, "text");
  return fmt::format(
      "\nend of {}:\n{}", text(log, "file"),
      lines.is_string() ? printableLines(lines.get_ref<const std::string&>()) : std::string("?\n"));
}

}  // namespace

std::string capsuleSummary(const Tree& capsule) {
  return fmt::format("\"{}\" {} {} after its start{}.", text(capsule, "process"),
                     causeText(at(capsule, "cause")), duration(capsule, "upNs"),
                     summaryOfHandling(capsule));
}

std::string capsuleText(const Tree& capsule) {
  auto all = capsuleSummary(capsule) + "\n\n";
  std::string command;
  for (const auto& word : at(capsule, "command")) command += ' ' + text(word);
  all += fmt::format(
      "  at       {} on host {}\n  process  pid {}, crate {}, {} restarts\n"
      "  command {}\n  folder   {}\n",
      text(capsule, "at"), text(capsule, "host"), text(capsule, "pid"), text(capsule, "crate"),
      text(capsule, "restarts"), command, text(capsule, "folder"));
  all += coreText(capsule);
  for (const auto& server : at(capsule, "servers")) all += serverText(server);
  return all + logText(at(capsule, "log"));
}

}  // namespace mpf::crate
