#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include "modules/core/io/json.hpp"

namespace km {

// Text that leaves a script, an attribute or a comment unless it is escaped.
inline constexpr const char* kHostileText = "</script><script>alert(1)</script><!-- \" ' & \\ ]]>";

inline std::size_t occurrences(const std::string& text, const std::string& part) {
  std::size_t n = 0;
  for (auto at = text.find(part); at != text.npos; at = text.find(part, at + 1)) ++n;
  return n;
}

// Content of the script element with that id, as a browser reads it.
inline Json data_of_page(const std::string& page, const std::string& id) {
  const std::string begin = "<script type=\"application/json\" id=\"" + id + "\">";
  const auto from = page.find(begin) + begin.size();
  return Json::parse(page.substr(from, page.find("</script", from) - from));
}

// Number of references of the page to other files.
inline std::size_t references_of_page(const std::string& page) {
  std::size_t n = 0;
  for (const char* reference : {"src=", "http:", "https:", "@import", "url(", "fetch("})
    n += occurrences(page, reference);
  return n;
}

}  // namespace km
