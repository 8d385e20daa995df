#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "modules/core/json.hpp"

namespace km {

/// A document for a browser that needs no other file and no network.
struct HtmlPage {
  std::string title;
  std::vector<std::string_view> styles;  ///< Texts, not files; inserted unchanged, like body.
  std::string body;
};

[[nodiscard]] std::string html_page(const HtmlPage& page);

/// A script element with `data`, for scripts that parse the text of the element with this `id`. No
/// text in `data` can end the element. Bytes that are not UTF-8 become the replacement character.
[[nodiscard]] std::string data_script(std::string_view id, const Json& data);

/// A script element with the sources as one module, in this order.
[[nodiscard]] std::string module_script(const std::vector<std::string_view>& sources);

/// "data:image/png;base64,...": the content of a file, in place of its address.
[[nodiscard]] std::string data_uri(std::string_view type, std::string_view bytes);

}  // namespace km
