// Routes of the gallery page, whose files are part of the program.
#include "server/api.h"
#include "web/page_files.h"

namespace retake {
namespace {

constexpr const char* kContentSecurityPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src 'self'; "
    "font-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

}  // namespace

void add_page_routes(HttpServer& server) {
  for (const PageFile& file : page_files())
    server.route("GET", file.path, [&file](const HttpRequest& request) {
      const auto accepted = request.headers.find("accept-encoding");
      const bool gzip = accepted != request.headers.end() && accepted->second.find("gzip") != std::string::npos &&
                        accepted->second.find("gzip;q=0") == std::string::npos;
      HttpResponse response;
      response.content_type = file.content_type;
      response.body = gzip ? file.gzip : file.identity;
      if (gzip) response.content_encoding = "gzip";
      response.etag = std::string(file.etag) + (gzip ? "-gzip" : "");
      response.cache_control = "no-cache";
      response.headers.emplace_back("Content-Security-Policy", kContentSecurityPolicy);
      response.headers.emplace_back("Vary", "Accept-Encoding");
      return response;
    });
}

}  // namespace retake
