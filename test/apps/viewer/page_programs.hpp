#pragma once

#include <filesystem>
#include <string>

#include "test/support/command.hpp"

namespace km {

/// Why the page cannot be opened on this host; empty if it can.
inline std::string missing_page_program() {
  if (run_command("node --version").exit_code != 0) return "no node (apt-get install nodejs)";
  for (const char* program : {"/usr/bin/chromium", "/usr/bin/chromium-browser"})
    if (std::filesystem::exists(program)) return {};
  return "no chromium (apt-get install chromium)";
}

}  // namespace km
