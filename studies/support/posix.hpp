#pragma once

#include <cstdio>
#include <string>

namespace tandem {

/// Creates a pipe whose ends are closed on exec(). Returns false on failure, with errno set. On systems without
/// pipe2(), a fork in another thread can inherit the ends in between.
bool make_pipe(int (&ends)[2]);

/// Makes the calling process end when its parent does. Does nothing on systems without prctl().
void end_with_parent();

/// Discards the text that is buffered for a stream, and clears its error state.
void discard_output(std::FILE* stream);

/// Returns a text that identifies a file or folder within its file system: the inode and, where the system knows it,
/// the time of creation. A copy has another text. Does not follow links. Returns an empty text on failure.
std::string file_identity(const char* path);
/// Returns whether the path is a folder, not a link to one, that belongs to the user of this process.
bool is_own_folder(const char* path);

enum class RenameMode { exchange, no_replace };
/// Renames atomically: exchanges both names, or fails if `to` exists. Returns false with errno = ENOSYS on systems
/// without renameat2().
bool rename_atomically(const char* from, const char* to, RenameMode mode);

}  // namespace tandem
