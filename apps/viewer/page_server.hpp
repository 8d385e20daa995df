#pragma once

#include <functional>
#include <memory>
#include <set>
#include <span>
#include <string>

#include "apps/viewer/view_store.hpp"
#include "modules/charts/html_page.hpp"
#include "modules/core/ids.hpp"

namespace km {

/// All files of the page: those in apps/viewer/page, the parts shared with other programs' pages,
/// and three.js under the names that its modules import.
[[nodiscard]] std::span<const PageFile> page_files();

struct PageServerOptions {
  std::string address =
      "127.0.0.1";          ///< Address to listen on; if not loopback, URLs need the token.
  int port = 8777;          ///< Port to listen on; 0: any free port.
  std::string page_folder;  ///< Folder with the files of the page, except for three.js; empty: all
                            ///< files are those embedded in the program.
  std::string hello;        ///< See hello_message().
  /// Called with the robots whose images some page requests, when this set has changed. Calls are
  /// in the order of the changes, by one thread at a time.
  std::function<void(const std::set<RobotId>&)> on_images;
};

/// Serves the page, and on its WebSocket all present and future messages of a store. Refuses
/// requests whose Origin is another site. A server without a token (see PageServerOptions::address)
/// also refuses requests whose host is not a name of this host.
class PageServer {
 public:
  /// `store` must outlive the server. Throws std::runtime_error that names address and port if they
  /// cannot be used.
  PageServer(ViewStore& store, PageServerOptions options);
  ~PageServer();
  PageServer(const PageServer&) = delete;
  PageServer& operator=(const PageServer&) = delete;

  /// Address to open in a browser, with the token if there is one.
  [[nodiscard]] const std::string& url() const { return url_; }

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
  std::string url_;
};

}  // namespace km
