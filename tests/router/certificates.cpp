// SPDX-License-Identifier: MIT
#include "tests/router/certificates.h"

#include <sys/wait.h>

#include <stdexcept>

#include "tests/support/program.h"

namespace mpf::router::test {
namespace {

// A configuration for `openssl ca`, the only command that accepts dates.
std::string authorityConfig(const std::string& folder, const std::string& authority) {
  return "[ca]\ndefault_ca=it\n[it]\ndatabase=" + folder + "/" + authority +
         ".index\nnew_certs_dir=" + folder +
         "\nrand_serial=yes\ndefault_md=sha256\npolicy=any\ncopy_extensions=copy\nunique_subject="
         "no\n[any]\ncommonName=supplied\n";
}

std::vector<std::string> dates(Valid valid) {
  if (valid == Valid::notAnyMore)
    return {"-startdate", "20200101000000Z", "-enddate", "20210203040500Z"};
  if (valid == Valid::notYet)
    return {"-startdate", "20980102030400Z", "-enddate", "20990101000000Z"};
  return {"-days", "2"};
}

}  // namespace

void openssl(std::vector<std::string> arguments) {
  arguments.insert(arguments.begin(), MPF_TEST_OPENSSL);
  mpf::test::Program program(arguments);
  const auto said = program.errors();
  const auto status = program.wait();
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0)
    throw std::runtime_error("openssl " + arguments[1] + ": " + said);
}

Certificates::Certificates(const mpf::test::TemporaryFolder& folder, std::string authority)
    : folder_(folder),
      authority_(std::move(authority)),
      authorities_(folder.file(authority_ + ".pem")) {
  folder_.write(authority_ + ".cnf", authorityConfig(folder_.path().string(), authority_));
  folder_.write(authority_ + ".index", "");
  openssl({"req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes",
           "-keyout", folder_.file(authority_ + ".key"), "-out", authorities_, "-subj",
           "/CN=" + authority_, "-days", "2"});
}

TlsFiles Certificates::files(const std::string& name, Valid valid) const {
  const auto stem = authority_ + "-" + name + std::to_string(static_cast<int>(valid));
  const auto request = folder_.file(stem + ".csr");
  TlsFiles files{folder_.file(stem + ".pem"), folder_.file(stem + ".key"), authorities_};
  openssl({"req", "-new", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:P-256", "-nodes",
           "-keyout", files.key, "-out", request, "-subj", "/CN=" + name, "-addext",
           "subjectAltName=DNS:" + name});
  std::vector<std::string> sign{"ca",
                                "-batch",
                                "-notext",
                                "-config",
                                folder_.file(authority_ + ".cnf"),
                                "-cert",
                                authorities_,
                                "-keyfile",
                                folder_.file(authority_ + ".key"),
                                "-in",
                                request,
                                "-out",
                                files.certificate};
  for (auto& word : dates(valid)) sign.push_back(std::move(word));
  openssl(std::move(sign));
  return files;
}

}  // namespace mpf::router::test
