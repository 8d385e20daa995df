#pragma once

#include <algorithm>
#include <cctype>
#include <string_view>

namespace km {

/// True for a possible name of a robot's folder: 1 to 64 letters, digits, _, - and ., not beginning
/// with a dot.
[[nodiscard]] inline bool is_folder_name(std::string_view name) {
  return !name.empty() && name.front() != '.' && name.size() <= 64 &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) {
           return std::isalnum(c) != 0 || c == '_' || c == '-' || c == '.';
         });
}

}  // namespace km
