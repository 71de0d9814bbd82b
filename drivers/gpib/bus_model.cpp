// SPDX-License-Identifier: MIT
#include "drivers/gpib/bus_model.h"

#include <algorithm>
#include <fmt/format.h>
#include <stdexcept>
#include <utility>

#include "drivers/gpib/instrument_port.h"

namespace mpf {
namespace {

// A talker and listeners that never pause continue at the next access.
constexpr int kMaxRounds = 1000;

}  // namespace

GpibBusModel::GpibBusModel() = default;
GpibBusModel::~GpibBusModel() = default;

void GpibBusModel::attach(const GpibAddress& address,
                          std::shared_ptr<GpibInstrumentModel> instrument) {
  if (!address.isValid())
    throw std::invalid_argument(
        fmt::format("model of an instrument at {}: GPIB addresses are 0 to 30", toString(address)));
  const std::lock_guard lock(mutex_);
  if (find(address) != nullptr)
    throw std::invalid_argument(fmt::format(
        "model of an instrument at {}: another instrument has the address", toString(address)));
  auto port = std::make_unique<GpibInstrumentPort>(address, std::move(instrument));
  auto& participant = *port;
  connections_.push_back({.participant = &participant, .port = std::move(port)});
  settle();
}

void GpibBusModel::connect(GpibParticipant& participant) {
  const std::lock_guard lock(mutex_);
  connections_.push_back({.participant = &participant});
  settle();
}

void GpibBusModel::disconnect(GpibParticipant& participant) {
  const std::lock_guard lock(mutex_);
  std::erase_if(connections_,
                [&](const Connection& each) { return each.participant == &participant; });
  merge();
  settle();
}

GpibLines GpibBusModel::lines() const {
  const std::lock_guard lock(mutex_);
  return lines_;
}

std::uint64_t GpibBusModel::changes() const {
  const std::lock_guard lock(mutex_);
  return changes_;
}

// ---- faults

void GpibBusModel::setFaultAfter(std::uint64_t changes, const GpibFault& fault) {
  const std::lock_guard lock(mutex_);
  const bool isOfLines =
      fault.kind == GpibFault::Kind::stuckActive || fault.kind == GpibFault::Kind::stuckInactive;
  if (!isOfLines && find(fault.at) == nullptr)
    throw std::invalid_argument(
        fmt::format("fault of a model: no instrument is attached at {}", toString(fault.at)));
  if (changes > 0) {
    planned_ = PlannedFault{changes_ + changes, fault};
    return;
  }
  apply(fault);
  settle();
}

void GpibBusModel::heal() {
  const std::lock_guard lock(mutex_);
  planned_.reset();
  stuckActive_ = stuckInactive_ = 0;
  for (auto& connection : connections_) {
    const auto before = std::exchange(connection.condition, Condition::works);
    if (!connection.port) continue;
    connection.port->setAccepts(true);
    if (before != Condition::works) connection.port->powerUp();
  }
  merge();
  settle();
}

void GpibBusModel::apply(const GpibFault& fault) {
  using Kind = GpibFault::Kind;
  auto* const connection = find(fault.at);
  if (fault.kind == Kind::stuckActive) stuckActive_ |= fault.lines;
  if (fault.kind == Kind::stuckInactive) stuckInactive_ |= fault.lines;
  if (fault.kind == Kind::frozen) connection->condition = Condition::frozen;
  if (fault.kind == Kind::neverAccepts) connection->port->setAccepts(false);
  if (fault.kind == Kind::vanished) {
    connection->condition = Condition::vanished;
    connection->driven = {};
  }
  merge();
}

// ---- lines

// Ends when nothing changes any more: then all participants wait.
void GpibBusModel::settle() {
  for (int round = 0; round < kMaxRounds; ++round) {
    if (!followAll() && !offerAll()) return;
  }
}

bool GpibBusModel::followAll() {
  bool hasChanged = false;
  for (auto& connection : connections_) {
    if (connection.condition == Condition::works)
      hasChanged |= drive(connection, connection.participant->follow(lines_));
  }
  return hasChanged;
}

bool GpibBusModel::offerAll() {
  bool hasChanged = false;
  for (auto& connection : connections_) {
    if (connection.condition == Condition::works && connection.participant->offer(lines_))
      hasChanged |= drive(connection, connection.participant->follow(lines_));
  }
  return hasChanged;
}

bool GpibBusModel::drive(Connection& connection, const GpibLines& driven) {
  if (connection.driven == driven) return false;
  connection.driven = driven;
  merge();
  ++changes_;
  if (planned_ && planned_->atChange == changes_)
    apply(std::exchange(planned_, std::nullopt)->fault);
  return true;
}

void GpibBusModel::merge() {
  GpibLines lines;
  for (const auto& connection : connections_) lines |= connection.driven;
  lines.control = static_cast<std::uint8_t>((lines.control | stuckActive_) & ~stuckInactive_);
  lines_ = lines;
}

GpibBusModel::Connection* GpibBusModel::find(const GpibAddress& address) {
  const auto found = std::ranges::find_if(connections_, [&](const Connection& connection) {
    return connection.port && connection.port->address() == address;
  });
  return found == connections_.end() ? nullptr : &*found;
}

}  // namespace mpf
