#pragma once

namespace tandem {

/// Creates a pipe whose ends are closed on exec(). Returns false on failure, with errno set. On systems without
/// pipe2(), a fork in another thread can inherit the ends in between.
bool make_pipe(int (&ends)[2]);

/// Makes the calling process end when its parent does. Does nothing on systems without prctl().
void end_with_parent();

enum class RenameMode { exchange, no_replace };
/// Renames atomically: exchanges both names, or fails if `to` exists. Returns false with errno = ENOSYS on systems
/// without renameat2().
bool rename_atomically(const char* from, const char* to, RenameMode mode);

}  // namespace tandem
