#pragma once
// Folders whose files are listed with their checksums in SHA256SUMS, as sha256sum reads it:
// registrations and bundles.

#include <cstdint>
#include <string>
#include <vector>

#include "data/files/atomic_folder.h"

namespace palpate::runner::registration {

inline constexpr const char* kChecksums = "SHA256SUMS";

/// Names of all files below a folder, sorted, folders separated by '/'. \throws UsageError: it is
/// not a folder, or has an entry that is neither file nor folder (such as a link), or a name that a
/// list of checksums cannot have
std::vector<std::string> files_below(const std::string& folder);

/// The bytes of a file in the folder; a link is not followed. \throws UsageError
std::string read_member(const std::string& folder, const std::string& name);
std::string checksum_of_member(const std::string& folder, const std::string& name);
std::uint64_t size_of_member(const std::string& folder, const std::string& name);

/// Writes a private file into a folder that is being made.
void write_member(const data::AtomicFolder& draft, const std::string& name,
                  const std::string& text);

/// Writes SHA256SUMS of all files in the folder. \param open  files that are not listed
void write_checksums(const data::AtomicFolder& draft, const std::vector<std::string>& open = {});

/// The lines that SHA256SUMS should have now. \param open  files that are not listed
std::string checksum_lines(const std::string& folder, const std::vector<std::string>& open = {});

/// Differences of a folder from its SHA256SUMS, a sentence for each file: "x.csv has changed".
/// Empty: none. \param open  files that are not listed
/// \throws UsageError: it has no such list, or an invalid one
std::vector<std::string> checksum_faults(const std::string& folder,
                                         const std::vector<std::string>& open = {});

/// Refuses to replace an existing folder, unless `force` is given and palpate made the folder: it
/// has the file `mark`, as every such folder, and only files that are listed or `open`. \throws
/// UsageError
void require_replaceable_folder(const std::string& folder, bool force, const std::string& mark,
                                const std::vector<std::string>& open = {});

}  // namespace palpate::runner::registration
