// viwo_seal FILE: writes the digest of a plugin into its build record. viwo_add_plugin() runs it
// after each link.
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <stdexcept>
#include <string>

#include "plugin_digest.hpp"
#include "plugin_file.hpp"
#include "viwo/plugin_host/build_record_check.hpp"

namespace {

namespace fs = std::filesystem;

/// In place of the old file at once: a program that runs may have that.
void replace(const fs::path& file, const std::string& bytes) {
  const fs::path unfinished = file.string() + ".tmp";
  std::ofstream out(unfinished, std::ios::binary);
  out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out.close();
  if (!out) throw std::runtime_error("cannot write " + unfinished.string());
  fs::permissions(unfinished, fs::status(file).permissions());
  fs::rename(unfinished, file);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: viwo_seal FILE\n";
    return EXIT_FAILURE;
  }
  try {
    const fs::path file = argv[1];
    std::string bytes = viwo::read_library(file).bytes;
    viwo::build_record_in(bytes, file);
    replace(file, viwo::sealed(std::move(bytes)));
  } catch (const std::exception& error) {
    std::cerr << "viwo_seal: " << error.what() << "\n";
    return EXIT_FAILURE;
  }
  return EXIT_SUCCESS;
}
