// SPDX-License-Identifier: MIT
#include "crate/config/crate_schema.h"

#include <algorithm>

#include "crate/config/program_kinds.h"

namespace mpf::crate {
namespace {

using Json = nlohmann::ordered_json;

Json text() { return {{"type", "string"}}; }
Json integer() { return {{"type", "integer"}}; }
Json texts() { return {{"oneOf", {text(), {{"type", "array"}, {"items", text()}}}}}; }
// A number above 0 with a unit, such as 1.5min.
const std::string kDuration =
    R"(([0-9]*[1-9][0-9]*(\.[0-9]+)?|[0-9]+\.[0-9]*[1-9][0-9]*)(ms|s|min))";
Json duration() { return {{"type", "string"}, {"pattern", "^" + kDuration + "$"}}; }
Json durationOrOff() { return {{"type", "string"}, {"pattern", "^(" + kDuration + "|off)$"}}; }
Json size() { return {{"type", {"string", "integer"}}, {"pattern", "^[0-9]+(KiB|MiB|GiB)?$"}}; }
Json variables() {
  return {{"type", "object"},
          {"additionalProperties", {{"type", {"string", "number", "boolean"}}}}};
}

Json table(Json properties, const std::vector<std::string>& required = {}) {
  Json schema{
      {"type", "object"}, {"properties", std::move(properties)}, {"additionalProperties", false}};
  if (!required.empty()) schema["required"] = required;
  return schema;
}

// A value of an option: a text or a number; a table, if it has fields; or a list of them.
Json valueOf(const OptionKind& option) {
  if (option.isFlag) return {{"type", "boolean"}};
  Json one{{"type", {"string", "number", "boolean"}}};
  if (!option.fields.empty()) {
    Json fields;
    for (const auto& field : option.fields) fields[field] = {{"type", {"string", "number"}}};
    one = {{"oneOf", {one, table(fields)}}};
  }
  return {{"oneOf", {one, {{"type", "array"}, {"items", one}, {"minItems", 1}}}}};
}

// A value of a key that is never an option.
Json positional() { return {{"type", {"string", "number", "boolean"}}}; }

Json supervisionKeys() {
  return {{"restart", {{"enum", {"always", "on-failure", "never"}}}},
          {"start-time", duration()},
          {"stop-time", duration()},
          {"stall-limit", durationOrOff()},
          {"busy-limit", durationOrOff()},
          {"first-pause", duration()},
          {"last-pause", duration()},
          {"max-restarts", {{"type", "integer"}, {"minimum", 0}}},
          {"restart-window", duration()}};
}

// The keys of all processes.
Json processKeys() {
  auto keys = supervisionKeys();
  keys.update({{"name", text()},
               {"needs", texts()},
               {"servers", texts()},
               {"location", integer()},
               {"user", text()},
               {"working-folder", text()},
               {"environment", variables()}});
  return keys;
}

Json programOf(const ProgramKind& kind) {
  auto keys = processKeys();
  keys["arguments"] = texts();
  std::vector<std::string> required;
  if (kind.entry == Entry::server) {
    keys["program"] = {{"const", kind.name}};
    required.emplace_back("program");
  }
  required.insert(required.end(), kind.positionals.begin(),
                  kind.positionals.begin() + static_cast<std::ptrdiff_t>(kind.required));
  for (const auto& key : kind.keys()) {
    if (keys.contains(key)) continue;
    const auto* const option = kind.findOption(key);
    const bool isPositional = std::ranges::find(kind.positionals, key) != kind.positionals.end();
    if (option != nullptr) keys[key] = valueOf(*option);
    else keys[key] = isPositional ? positional() : valueOf(OptionKind{key, {}});
  }
  return table(keys, required);
}

Json listOf(Entry entry) {
  auto kinds = Json::array();
  for (const auto& kind : programKinds())
    if (kind.entry == entry) kinds.push_back(programOf(kind));
  return {{"type", "array"}, {"items", {{"oneOf", kinds}}}};
}

}  // namespace

nlohmann::ordered_json crateSchema() {
  Json keys{{"name", text()}, {"backplane", text()}, {"location", integer()}, {"user", text()}};
  for (const auto& key : commonKeys()) keys[key] = text();
  keys["environment"] = variables();
  keys["supervision"] = table(supervisionKeys());
  keys["capsules"] = table({{"count", integer()}, {"size", size()}});
  keys["logs"] = table({{"size", size()}});
  keys["carriers"] = {{"type", "object"}, {"additionalProperties", text()}};
  keys["server"] = listOf(Entry::server);
  keys["router"] = listOf(Entry::router);
  keys["ioc"] = listOf(Entry::ioc);
  auto command = processKeys();
  command["command"] = texts();
  command["notify"] = {{"type", "boolean"}};
  keys["program"] = {{"type", "array"}, {"items", table(command, {"name", "command"})}};
  auto schema = table(keys);
  schema["$schema"] = "https://json-schema.org/draft/2020-12/schema";
  schema["title"] = "Crate file of MPF";
  return schema;
}

}  // namespace mpf::crate
