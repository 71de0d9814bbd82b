// SPDX-License-Identifier: MIT
#include <mpf/drivers/industry_pack/model_carrier.h>

#include <atomic>
#include <fmt/format.h>
#include <stdexcept>
#include <utility>

namespace mpf {
// A named namespace, because ModelSite, which the header declares, has members of these types.
namespace model_site {

constexpr std::size_t kIoBytes = 128;
constexpr std::size_t kIdBytes = 128;
constexpr std::uint16_t kOnes = 0xffff;

// An interrupt request line of a model: passes on one interrupt and is then masked until enable().
class ModelInterrupt final : public Interrupt {
 public:
  void enable() override {
    const std::lock_guard lock(mutex_);
    isEnabled_ = true;
    passOn();
  }
  void disable() noexcept override {
    const std::lock_guard lock(mutex_);
    isEnabled_ = false;
  }
  void setLine(bool active) {
    const std::lock_guard lock(mutex_);
    isActive_ = active;
    passOn();
  }
  void setFault(ModelFault fault) {
    const std::lock_guard lock(mutex_);
    fault_ = fault;
    passOn();
  }

 private:
  void passOn() noexcept {
    const bool comes =
        fault_ == ModelFault::interruptStorm || (isActive_ && fault_ == ModelFault::none);
    if (comes && std::exchange(isEnabled_, false)) announce();
  }

  std::mutex mutex_;
  bool isActive_ = false;
  bool isEnabled_ = false;
  ModelFault fault_ = ModelFault::none;
};

// The model in a site; looked up at each bus cycle, since it may be unplugged at any time.
struct Socket {
  std::atomic<DeviceModel*> model{nullptr};
  std::atomic<bool> isBroken{false};  // busError

  DeviceModel* plugged() const noexcept {
    // PAIR(model-plugged): the model is complete.
    return isBroken.load(std::memory_order_relaxed) ? nullptr
                                                    : model.load(std::memory_order_acquire);
  }
};

// One address space of a model; turns accesses into 16-bit cycles.
class ModelRegisters : public Registers {
 public:
  explicit ModelRegisters(std::size_t bytes) : bytes_(bytes) {}
  [[nodiscard]] std::size_t size() const noexcept override { return bytes_; }

 private:
  using Lanes = DeviceModel::Lanes;
  virtual std::uint16_t readCycle(std::size_t offset, Lanes lanes) = 0;
  virtual void writeCycle(std::size_t offset, std::uint16_t value, Lanes lanes) = 0;

  static bool isOdd(std::size_t offset) noexcept { return (offset & 1) != 0; }
  std::uint8_t doRead8(std::size_t offset) override {
    if (isOdd(offset)) return static_cast<std::uint8_t>(readCycle(offset - 1, DeviceModel::kLow));
    return static_cast<std::uint8_t>(readCycle(offset, DeviceModel::kHigh) >> 8);
  }
  std::uint16_t doRead16(std::size_t offset) override {
    return readCycle(offset, DeviceModel::kBoth);
  }
  std::uint32_t doRead32(std::size_t offset) override {
    const std::uint32_t high = readCycle(offset, DeviceModel::kBoth);
    return high << 16 | readCycle(offset + 2, DeviceModel::kBoth);
  }
  void doWrite8(std::size_t offset, std::uint8_t value) override {
    if (isOdd(offset)) return writeCycle(offset - 1, value, DeviceModel::kLow);
    writeCycle(offset, static_cast<std::uint16_t>(value << 8), DeviceModel::kHigh);
  }
  void doWrite16(std::size_t offset, std::uint16_t value) override {
    writeCycle(offset, value, DeviceModel::kBoth);
  }
  void doWrite32(std::size_t offset, std::uint32_t value) override {
    writeCycle(offset, static_cast<std::uint16_t>(value >> 16), DeviceModel::kBoth);
    writeCycle(offset + 2, static_cast<std::uint16_t>(value), DeviceModel::kBoth);
  }

  std::size_t bytes_;
};

class SpaceRegisters final : public ModelRegisters {
 public:
  SpaceRegisters(const Socket& socket, DeviceModel::Space space, std::size_t bytes)
      : ModelRegisters(bytes), socket_(socket), space_(space) {}

 private:
  std::uint16_t readCycle(std::size_t offset, DeviceModel::Lanes lanes) override {
    auto* const model = socket_.plugged();
    return model == nullptr ? kOnes : model->read(space_, offset, lanes);
  }
  void writeCycle(std::size_t offset, std::uint16_t value, DeviceModel::Lanes lanes) override {
    if (auto* const model = socket_.plugged()) model->write(space_, offset, value, lanes);
  }

  const Socket& socket_;
  DeviceModel::Space space_;
};

class IdRegisters final : public ModelRegisters {
 public:
  explicit IdRegisters(const Socket& socket) : ModelRegisters(kIdBytes), socket_(socket) {}

 private:
  std::uint16_t readCycle(std::size_t offset, DeviceModel::Lanes /*lanes*/) override {
    auto* const model = socket_.plugged();
    if (model == nullptr) return kOnes;
    const auto words = wordsOf(model->id());
    // an 8-bit PROM drives D7..0 only
    const std::uint16_t unused = model->id().format == IdProm::Format::one ? 0xff00 : 0;
    return offset / 2 < words.size() ? words[offset / 2] | unused : unused;
  }
  void writeCycle(std::size_t /*offset*/, std::uint16_t /*value*/,
                  DeviceModel::Lanes /*lanes*/) override {}

  const Socket& socket_;
};

}  // namespace model_site

class ModelSite final : public IndustryPackSite {
 public:
  explicit ModelSite(std::size_t memoryBytes)
      : id_(socket_),
        io_(socket_, DeviceModel::Space::io, model_site::kIoBytes),
        memory_(socket_, DeviceModel::Space::memory, memoryBytes) {}

  [[nodiscard]] Registers& id() override { return id_; }
  [[nodiscard]] Registers& io() override { return io_; }
  [[nodiscard]] Registers& memory() override { return memory_; }
  [[nodiscard]] Interrupt& interrupt(int number) override { return line(number); }

  void plug(std::unique_ptr<DeviceModel> model) {
    owned_ = std::move(model);
    owned_->connectInterrupts([this](int number, bool active) { line(number).setLine(active); });
    // PAIR(model-plugged): the model is complete before it can be found.
    socket_.model.store(owned_.get(), std::memory_order_release);
  }
  std::unique_ptr<DeviceModel> unplug() {
    socket_.model.store(nullptr, std::memory_order_relaxed);
    if (owned_) owned_->connectInterrupts({});
    for (auto& line : lines_) line.setLine(false);
    return std::move(owned_);
  }
  void setFault(ModelFault fault) {
    socket_.isBroken.store(fault == ModelFault::busError, std::memory_order_relaxed);
    for (auto& line : lines_) line.setFault(fault);
  }
  void setFault(ModelFault fault, int number) { line(number).setFault(fault); }
  [[nodiscard]] bool isTaken() const noexcept { return owned_ != nullptr; }

 private:
  model_site::ModelInterrupt& line(int number) {
    return lines_.at(static_cast<std::size_t>(number));
  }

  model_site::Socket socket_;
  model_site::IdRegisters id_;
  model_site::SpaceRegisters io_;
  model_site::SpaceRegisters memory_;
  std::array<model_site::ModelInterrupt, 2> lines_;
  std::unique_ptr<DeviceModel> owned_;
};

ModelCarrier::ModelCarrier(std::size_t sites, std::size_t memoryBytes) {
  for (std::size_t i = 0; i < sites; ++i)
    sites_.push_back(std::make_unique<ModelSite>(memoryBytes));
}

ModelCarrier::~ModelCarrier() = default;

IndustryPackSite& ModelCarrier::site(std::size_t number) { return *sites_.at(number); }

ModelSite& ModelCarrier::find(const std::string& siteName) const {
  for (std::size_t i = 0; i < sites_.size(); ++i) {
    if (mpf::siteName(i) == siteName) return *sites_[i];
  }
  throw std::invalid_argument(fmt::format("no site \"{}\"; the sites are {} to {}", siteName,
                                          mpf::siteName(0), mpf::siteName(sites_.size() - 1)));
}

void ModelCarrier::plugAny(const std::string& siteName, std::unique_ptr<DeviceModel> model) {
  auto& site = find(siteName);
  if (site.isTaken())
    throw std::invalid_argument(
        fmt::format("site {} already has a model; unplug it first", siteName));
  site.plug(std::move(model));
}

void ModelCarrier::unplug(const std::string& siteName) {
  // Keeps the model, since another thread may be in a bus cycle.
  if (auto model = find(siteName).unplug()) unplugged_.push_back(std::move(model));
}

void ModelCarrier::setFault(const std::string& siteName, ModelFault fault) {
  find(siteName).setFault(fault);
}

void ModelCarrier::setFault(const std::string& siteName, ModelFault fault, int line) {
  find(siteName).setFault(fault, line);
}

}  // namespace mpf
