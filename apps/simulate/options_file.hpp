#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>

namespace km {

/// What is wrong with a file of options of `app`, lines `option = value` as in config/simulation/:
/// a line per problem with the file's name, the line and what would be right; empty if nothing is.
/// Values are checked as on the command line.
[[nodiscard]] std::string problems_of_options_file(CLI::App& app,
                                                   const std::filesystem::path& file);

}  // namespace km
