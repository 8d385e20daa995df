#pragma once

#include <string>
#include <string_view>

namespace km {

/// `text` for use in the content or in a quoted attribute of an XML document.
[[nodiscard]] std::string xml_escaped(std::string_view text);

}  // namespace km
