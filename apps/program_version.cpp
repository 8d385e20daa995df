#include "apps/program_version.hpp"

#include "commit.hpp"  // written by the build

namespace km {

std::string built_version() {
  return KM_VERSION;
}

std::string built_commit() {
  return kCommit;
}

std::string version_text(const std::string& program) {
  return program + ' ' + built_version() + "\ncommit " + built_commit() +
         "\nbuilt with " KM_BUILT_WITH;
}

}  // namespace km
