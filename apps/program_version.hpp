#pragma once

#include <string>

namespace km {

/// The commit of the sources that this program is built from: ten digits, with "-changed" if files
/// differ from it; "unknown" if they are in no git repository.
[[nodiscard]] std::string built_commit();

/// What --version prints: the program's name and version, the commit, the compiler, the build type,
/// and the versions of the libraries.
[[nodiscard]] std::string version_text(const std::string& program);

}  // namespace km
