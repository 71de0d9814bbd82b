// SPDX-License-Identifier: MIT
#include <nlohmann/json.hpp>

#include "benchmarks/local/report.h"

namespace mpf::bench {
namespace {

using Json = nlohmann::ordered_json;

void addFigures(Json& object, const Result& result) {
  const auto& latency = result.figures.latency;
  if (const auto& faults = result.figures.lineFaults; faults.shortAnswers >= 0) {
    object["short_answers"] = faults.shortAnswers;
    object["overrun_answers"] = faults.overruns;
    object["parity_answers"] = faults.parity;
    object["framing_answers"] = faults.framing;
    object["break_answers"] = faults.breaks;
  }
  if (!result.measurement.unit.empty()) {
    object["value"] = result.figures.value;
    object["unit"] = result.measurement.unit;
    return;
  }
  if (latency.count() != 0) {
    object["p50_ns"] = latency.percentileNs(50);
    object["p99_ns"] = latency.percentileNs(99);
    object["p999_ns"] = latency.percentileNs(99.9);
    object["max_ns"] = latency.maxNs();
    if (result.figures.typicalNs > 0) object["typical_ns"] = result.figures.typicalNs;
    object["mean_ns"] = latency.meanNs();
    object["samples"] = latency.count();
  }
  if (result.figures.perSecond > 0) object["per_s"] = result.figures.perSecond;
  if (latency.count() == 0) object["samples"] = result.figures.count;
  if (result.figures.writesPerSecond >= 0) object["writes_per_s"] = result.figures.writesPerSecond;
  if (result.figures.idleServer >= 0)
    object["idle_server_percent"] = 100 * result.figures.idleServer;
  if (result.figures.idleRequester >= 0)
    object["idle_client_percent"] = 100 * result.figures.idleRequester;
}

Json toObject(const Result& result, const Machine& machine, const Placement& placement) {
  const auto& what = result.measurement;
  Json object;
  object["name"] = what.name;
  if (!what.setting.empty()) object["setting"] = what.setting;
  object["question"] = what.question;
  object["mode"] = toString(what.mode);
  object["bytes"] = what.bytes;
  object["touched"] = what.touched;
  if (!what.detail.empty()) object["detail"] = what.detail;
  if (!what.skipped.empty()) {
    object["skipped"] = what.skipped;
  } else if (!result.error.empty()) {
    object["error"] = result.error;
  } else {
    addFigures(object, result);
  }
  object["floor_name"] = what.floorName.empty() ? Json() : Json(what.floorName);
  object["floor_ns"] = result.floorNs > 0 ? Json(result.floorNs) : Json();
  object["ratio_to_floor"] = result.ratioToFloor > 0 ? Json(result.ratioToFloor) : Json();
  if (result.disturbance.availableNs > 0) {
    object["disturbed"] = result.isDisturbed();
    object["disturbed_percent"] = 100 * result.disturbance.share();
    object["preemptions"] = result.disturbance.preemptions;
  }
  if (result.rounds > 0) object["rounds"] = result.rounds;
  if (result.floorDrift > 0) object["floor_drift"] = result.floorDrift;
  if (result.lineDrift > 0) object["line_drift"] = result.lineDrift;
  auto cpus = placement.server;
  cpus.insert(cpus.end(), placement.requester.begin(), placement.requester.end());
  object["cpus"] = cpus;
  object["machine"] = {{"cpu", machine.cpu},           {"kernel", machine.kernel},
                       {"governor", machine.governor}, {"placement", machine.placement},
                       {"virtual", machine.isVirtual}, {"load", machine.load}};
  return object;
}

}  // namespace

std::string toJson(const std::vector<Result>& results, const Machine& machine,
                   const Placement& placement) {
  auto list = Json::array();
  for (const auto& result : results) list.push_back(toObject(result, machine, placement));
  return list.dump(1) + "\n";
}

}  // namespace mpf::bench
