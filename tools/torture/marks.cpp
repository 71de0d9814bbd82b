// SPDX-License-Identifier: MIT
#include "tools/torture/marks.h"

#include <fcntl.h>

#include <cstring>
#include <gelf.h>
#include <libelf.h>
#include <link.h>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <utility>

#include <mpf/file_descriptor.h>

#include "base/system_call.h"

namespace mpf::torture {
namespace {

constexpr const char* kProgram = "/proc/self/exe";
constexpr unsigned kProbe = 3;  // type of a note of owner "stapsdt"

// The offset at which the loader has placed this program.
Marks::Address loadedAt() {
  Marks::Address moved = 0;
  ::dl_iterate_phdr(
      [](dl_phdr_info* info, std::size_t, void* out) {
        *static_cast<Marks::Address*>(out) = info->dlpi_addr;
        return 1;  // stop: the first entry is the program
      },
      &moved);
  return moved;
}

// Address and name of a probe of provider "mpf". The note consists of three addresses, and then
// provider, name and arguments, each ended by a zero byte.
std::optional<std::pair<Marks::Address, std::string>> tryProbe(const char* note,
                                                               std::size_t bytes) {
  constexpr auto kAddresses = 3 * sizeof(std::uint64_t);
  if (bytes <= kAddresses || note[bytes - 1] != '\0') return std::nullopt;
  std::uint64_t address = 0;
  std::memcpy(&address, note, sizeof address);
  const std::string_view provider(note + kAddresses);
  const auto nameAt = kAddresses + provider.size() + 1;
  if (provider != "mpf" || nameAt >= bytes) return std::nullopt;
  return std::pair{address, std::string(note + nameAt)};
}

template <class Visit>
void forEachProbe(Elf_Data& data, Visit&& visit) {
  GElf_Nhdr header{};
  std::size_t name = 0;
  std::size_t body = 0;
  for (std::size_t at = 0; (at = ::gelf_getnote(&data, at, &header, &name, &body)) != 0;) {
    const auto* bytes = static_cast<const char*>(data.d_buf);
    if (header.n_type != kProbe || std::string_view(bytes + name) != "stapsdt") continue;
    if (auto probe = tryProbe(bytes + body, header.n_descsz)) visit(std::move(*probe));
  }
}

}  // namespace

Marks Marks::ofThisProgram() {
  const FileDescriptor file(checkCall(::open(kProgram, O_RDONLY | O_CLOEXEC), "open", kProgram));
  ::elf_version(EV_CURRENT);
  const std::unique_ptr<Elf, int (*)(Elf*)> elf(::elf_begin(file.get(), ELF_C_READ, nullptr),
                                                ::elf_end);
  if (!elf) throw std::runtime_error(std::string("read ") + kProgram + ": " + ::elf_errmsg(-1));
  const auto moved = loadedAt();
  Marks marks;
  for (Elf_Scn* section = nullptr; (section = ::elf_nextscn(elf.get(), section)) != nullptr;) {
    GElf_Shdr header{};
    if (::gelf_getshdr(section, &header) == nullptr || header.sh_type != SHT_NOTE) continue;
    auto* data = ::elf_getdata(section, nullptr);
    if (data == nullptr) continue;
    forEachProbe(*data, [&](std::pair<Address, std::string> probe) {
      marks.byName_[probe.second].push_back(moved + probe.first);
      marks.byAddress_.emplace(moved + probe.first, probe.second);
    });
  }
  if (marks.byName_.empty())
    throw std::runtime_error(
        "this program has no steps (section .note.stapsdt): they were stripped from it; use the "
        "program as it was built");
  return marks;
}

const std::string* Marks::find(Address address) const {
  const auto found = byAddress_.find(address);
  return found == byAddress_.end() ? nullptr : &found->second;
}

}  // namespace mpf::torture
