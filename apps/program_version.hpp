#pragma once

#include <string>

namespace km {

/// The project's version, as "0.1.0".
[[nodiscard]] std::string built_version();

/// The commit that this program is built from: ten digits or more. "-dirty" follows if tracked
/// files differ from it. "unknown" if the sources are not in a git repository.
[[nodiscard]] std::string built_commit();

/// Output of --version: the program's name and version, the commit, the compiler, the build type,
/// and the versions of the libraries.
[[nodiscard]] std::string version_text(const std::string& program);

}  // namespace km
