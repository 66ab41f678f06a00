// Routes of the gallery page, whose files are part of the program.
#include "server/api/api.h"
#include "web/page_files.h"

namespace retake {
namespace {

constexpr const char* kContentSecurityPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src "
    "'self'; "
    "font-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

}  // namespace

void add_page_routes(HttpServer& server) {
  for (const PageFile& file : page_files())
    server.route("GET", file.path, [&file](const HttpRequest&) {
      HttpResponse response;
      response.content_type = file.content_type;
      response.body = file.gzip;
      response.content_encoding = "gzip";  // the server unpacks it for clients that want it plain
      response.etag = file.etag;
      response.cache_control = "no-cache";
      response.headers.emplace_back("Content-Security-Policy", kContentSecurityPolicy);
      return response;
    });
}

}  // namespace retake
