#pragma once

#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include "modules/core/input_file.hpp"

namespace km {

/// The value of an optional file: a default value if there is none. `notes` names a file that
/// cannot be read, and states why.
template <typename Read>
auto read_if_there(const std::filesystem::path& file, std::vector<std::string>& notes,
                   const Read& read) try {
  return is_there(file) ? read(file) : decltype(read(file))();
} catch (const std::exception& error) {
  const std::string what = error.what(), name = file.string();
  notes.push_back(what.starts_with(name) ? what : name + ": " + what);
  return decltype(read(file))();
}

}  // namespace km
