// SPDX-License-Identifier: MIT
// GpibBusModel: a GPIB bus with its lines, instruments on it, and faults.
//
//   GpibBusModel bus;
//   bus.attach({22}, std::make_shared<MeterModel>());
//   bus.setFaultAfter(100, {.kind = GpibFault::Kind::vanished, .at = {22}});
//
//   controller ─┐                ┌─ instrument 22
//               ├─ DAV NRFD NDAC ┼─ instrument 5.1
//               ...  wired-or  ...
//
// The bus needs no time and no thread: after each access by the controller, the handshake continues
// until a participant waits. An instrument that had no byte, or did not take one, is asked again at
// the next access and by proceed().
//
// Threads  any number of callers at a time.
// Source   IEEE 488.1.
#pragma once

#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include <mpf/drivers/gpib/gpib_types.h>

#include "drivers/gpib/bus_participant.h"
#include "drivers/gpib/instrument_model.h"

namespace mpf {

class GpibInstrumentPort;

struct GpibFault {
  enum class Kind : std::uint8_t {
    stuckActive,  // lines are active whatever is driven: a short circuit
    stuckInactive,  // lines are inactive whatever is driven: a broken cable at the controller
    vanished,  // the instrument drives nothing and takes no command: it has lost its power
    frozen,  // the instrument keeps driving what it drove: its program has stopped
    neverAccepts,  // the instrument takes commands, but never a data byte
  };
  Kind kind = Kind::vanished;
  std::uint8_t lines = 0;  // of gpib_line, for the first two kinds
  GpibAddress at{};  // for the others
};

class GpibBusModel {
 public:
  GpibBusModel();
  GpibBusModel(const GpibBusModel&) = delete;
  GpibBusModel& operator=(const GpibBusModel&) = delete;
  ~GpibBusModel();

  // Several instruments may have the same primary address and different secondary addresses.
  //   throws  std::invalid_argument when the address is in use or does not exist
  void attach(const GpibAddress& address, std::shared_ptr<GpibInstrumentModel> instrument);
  // A participant of another kind: a controller. It must be disconnected before it is destroyed.
  void connect(GpibParticipant& participant);
  void disconnect(GpibParticipant& participant);

  // Calls `act` with the lines, under the lock, and returns what it returns. For registers of a
  // controller that change nothing on the bus.
  template <class Act>
  auto look(Act act) {
    const std::lock_guard lock(mutex_);
    return act(lines_);
  }
  // The same, then lets the handshake continue. For the other registers of a controller, and for
  // what a test does to an instrument.
  template <class Act>
  auto access(Act act) {
    const std::lock_guard lock(mutex_);
    const SettlesAtEnd settles{*this};
    return act(lines_);
  }
  // Lets the handshake go on, after an instrument has changed.
  void proceed() {
    access([](const GpibLines& /*lines*/) {});
  }
  [[nodiscard]] GpibLines lines() const;

  // Adds a fault, now or after so many changes of the lines.
  //   throws  std::invalid_argument when no such instrument is attached
  void setFault(const GpibFault& fault) { setFaultAfter(0, fault); }
  void setFaultAfter(std::uint64_t changes, const GpibFault& fault);
  // Ends all faults; instruments that had vanished or were frozen are switched off and on.
  void heal();
  // How often the lines have changed.
  [[nodiscard]] std::uint64_t changes() const;

 private:
  enum class Condition : std::uint8_t { works, vanished, frozen };
  struct Connection {
    GpibParticipant* participant = nullptr;
    std::unique_ptr<GpibInstrumentPort> port{};  // null: another kind of participant
    GpibLines driven{};
    Condition condition = Condition::works;
  };
  struct SettlesAtEnd {
    GpibBusModel& bus;
    ~SettlesAtEnd() { bus.settle(); }
  };
  void settle();
  bool followAll();
  bool offerAll();
  bool drive(Connection& connection, const GpibLines& driven);
  void merge();
  void apply(const GpibFault& fault);
  Connection* find(const GpibAddress& address);

  mutable std::mutex mutex_;
  std::vector<Connection> connections_;
  GpibLines lines_;
  std::uint8_t stuckActive_ = 0;
  std::uint8_t stuckInactive_ = 0;
  std::uint64_t changes_ = 0;
  struct PlannedFault {
    std::uint64_t atChange = 0;
    GpibFault fault;
  };
  std::optional<PlannedFault> planned_;
};

}  // namespace mpf
