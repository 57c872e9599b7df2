// A folder of its own for a test that writes files; it goes with all that is in it.
#pragma once
#include <cstdlib>
#include <filesystem>
#include <stdexcept>
#include <string>

namespace wisp {

class TemporaryFolder {
  public:
    TemporaryFolder() {
        std::string pattern = (std::filesystem::temp_directory_path() / "wisp-test-XXXXXX").string();
        if (!mkdtemp(pattern.data())) throw std::runtime_error("no folder for temporary files");
        path_ = pattern;
    }
    ~TemporaryFolder() {
        std::error_code ignored;
        std::filesystem::remove_all(path_, ignored);
    }
    TemporaryFolder(const TemporaryFolder &) = delete;
    TemporaryFolder &operator=(const TemporaryFolder &) = delete;

    // The name of a file in the folder.
    std::string file(const std::string &name) const { return (path_ / name).string(); }

    // How many entries the folder has.
    size_t entries() const {
        size_t count = 0;
        for (const auto &entry : std::filesystem::directory_iterator(path_)) count += entry.exists();
        return count;
    }

  private:
    std::filesystem::path path_;
};

} // namespace wisp
