//! Memory limit of this process: `--max-memory`, or else the free memory of the machine or of the
//! control group, which is known on Linux only.

use std::fmt;
use std::fs;
use std::path::Path;

/// Maximum memory of this process.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct MemoryLimit {
    /// Limit in bytes.
    pub bytes: u64,
    /// Source of the limit.
    pub source: LimitSource,
}

/// Source of a memory limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LimitSource {
    /// The flag `--max-memory`.
    Flag,
    /// The available memory of the machine.
    Machine,
    /// A control group, such as the group of a container or a job.
    ControlGroup,
}

impl MemoryLimit {
    /// `max_memory` if given, else the limit of the system. `None` if the limit of the system is
    /// unknown.
    pub fn of(max_memory: Option<u64>) -> Option<Self> {
        let source = LimitSource::Flag;
        max_memory.map(|bytes| Self { bytes, source }).or_else(limit_of_system)
    }

    /// Bytes that this process may still allocate, in addition to the memory that it already has.
    /// `None` if unknown.
    pub fn left_by_system() -> Option<u64> {
        limit_below(Path::new("/")).map(|limit| limit.bytes.saturating_sub(own_bytes(Path::new("/"))))
    }

    /// Reason, in words, why `more` bytes cannot be allocated; `total` is the memory of the process
    /// after the allocation. `None` if the allocation is possible. A test allocation finds limits
    /// that the system does not publish, such as `ulimit -v`.
    pub fn refusal(limit: Option<Self>, total: u64, more: u64) -> Option<String> {
        match limit {
            Some(limit) if total > limit.bytes => Some(format!("more than {limit}")),
            _ if !can_be_had(more) => Some("more than the system allows this process (ulimit -v)".into()),
            _ => None,
        }
    }
}

impl fmt::Display for MemoryLimit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let bytes = in_words(self.bytes);
        match self.source {
            LimitSource::Flag => write!(f, "the {bytes} of --max-memory"),
            LimitSource::Machine => write!(f, "the {bytes} that are available (--max-memory sets another limit)"),
            LimitSource::ControlGroup => {
                write!(
                    f,
                    "the {bytes} that the control group allows (--max-memory sets another limit)"
                )
            }
        }
    }
}

/// Returns true if `bytes` can be allocated in one block. The bytes are freed at once, untouched,
/// so the test is cheap.
fn can_be_had(bytes: u64) -> bool {
    let mut probe: Vec<u8> = Vec::new();
    let had = usize::try_from(bytes).is_ok_and(|bytes| probe.try_reserve_exact(bytes).is_ok());
    // The compiler might remove an unused allocation.
    std::hint::black_box(&probe);
    had
}

/// Number of bytes as text, such as `1.3 GB`.
pub fn in_words(bytes: u64) -> String {
    let bytes = bytes as f64;
    let units = [(1e9, "GB"), (1e6, "MB"), (1e3, "kB")];
    let unit = units.into_iter().find(|(size, _)| bytes >= *size);
    unit.map_or_else(
        || format!("{bytes} bytes"),
        |(size, unit)| format!("{:.1} {unit}", bytes / size),
    )
}

/// Memory that this process may have in total: the memory that it already has, plus the minimum of
/// the free memory of the machine and of its control groups.
fn limit_of_system() -> Option<MemoryLimit> {
    limit_below(Path::new("/"))
}

/// [`limit_of_system`], with the folders `proc` and `sys` in the folder `root`. Tests use another
/// folder than `/`.
fn limit_below(root: &Path) -> Option<MemoryLimit> {
    let own = own_bytes(root);
    let of_machine = kilobytes(&root.join("proc/meminfo"), "MemAvailable:").map(|bytes| MemoryLimit {
        bytes: bytes.saturating_add(own),
        source: LimitSource::Machine,
    });
    let of_group = left_by_groups(root).map(|bytes| MemoryLimit {
        bytes: bytes.saturating_add(own),
        source: LimitSource::ControlGroup,
    });
    [of_machine, of_group]
        .into_iter()
        .flatten()
        .min_by_key(|limit| limit.bytes)
}

/// Resident memory of this process in bytes.
fn own_bytes(root: &Path) -> u64 {
    kilobytes(&root.join("proc/self/status"), "VmRSS:").unwrap_or(0)
}

/// Value in bytes of the line of `path` that begins with `key`. The file has the value in
/// kilobytes.
fn kilobytes(path: &Path, key: &str) -> Option<u64> {
    let text = fs::read_to_string(path).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(key))?;
    let number: u64 = line.trim().trim_end_matches("kB").trim_end().parse().ok()?;
    Some(number.saturating_mul(1024))
}

/// File names of a version of control groups: mount point, limit and usage.
struct Groups {
    mount: &'static str,
    limit: &'static str,
    usage: &'static str,
    /// Keys of the file cache in `memory.stat`. The system can reclaim this memory.
    files: [&'static str; 2],
}

const VERSION_1: Groups = Groups {
    mount: "sys/fs/cgroup/memory",
    limit: "memory.limit_in_bytes",
    usage: "memory.usage_in_bytes",
    files: ["total_inactive_file", "total_active_file"],
};
const VERSION_2: Groups = Groups {
    mount: "sys/fs/cgroup",
    limit: "memory.max",
    usage: "memory.current",
    files: ["inactive_file", "active_file"],
};

/// Minimum of the bytes that are free in the control group of this process and in its ancestors.
fn left_by_groups(root: &Path) -> Option<u64> {
    // Lines are `0::/path` in version 2 and `NUMBER:memory:/path` in version 1 (cgroups(7)).
    let text = fs::read_to_string(root.join("proc/self/cgroup")).ok()?;
    let of_line = |line: &str| {
        let mut parts = line.splitn(3, ':');
        let (number, controllers, path) = (parts.next()?, parts.next()?, parts.next()?);
        let groups = match controllers {
            "" if number == "0" => VERSION_2,
            _ if controllers.split(',').any(|name| name == "memory") => VERSION_1,
            _ => return None,
        };
        let mount = root.join(groups.mount);
        // In a container, the path may be a path of the host, which does not exist here. The group
        // of the container is then at the mount point.
        let own = mount.join(path.trim_start_matches('/'));
        let folders = own.ancestors().take_while(|folder| folder.starts_with(&mount));
        folders.filter_map(|folder| groups.left(folder)).min()
    };
    text.lines().filter_map(of_line).min()
}

impl Groups {
    /// Bytes that the group in `folder` may still allocate below its limit. `None` if the group has
    /// no limit.
    fn left(&self, folder: &Path) -> Option<u64> {
        let number = |name: &str| -> Option<u64> { fs::read_to_string(folder.join(name)).ok()?.trim().parse().ok() };
        // If there is no limit, the file has a word (version 2) or a number near 2⁶³ (version 1).
        let limit = number(self.limit).filter(|&limit| limit < 1 << 60)?;
        let statistics = fs::read_to_string(folder.join("memory.stat")).unwrap_or_default();
        let pairs = statistics.lines().filter_map(|line| line.split_once(' '));
        let files: u64 = pairs
            .filter(|(name, _)| self.files.contains(name))
            .filter_map(|(_, bytes)| bytes.trim().parse::<u64>().ok())
            .sum();
        let used = number(self.usage).unwrap_or(0).saturating_sub(files);
        Some(limit.saturating_sub(used))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn write(root: &Path, name: &str, text: &str) {
        let path = root.join(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }

    #[test]
    fn limit_is_the_minimum_of_machine_and_groups() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path();
        assert_eq!(limit_below(root), None);
        let limit = |bytes, source| Some(MemoryLimit { bytes, source });
        write(root, "proc/meminfo", "MemTotal: 9000 kB\nMemAvailable:    5000 kB\n");
        assert_eq!(limit_below(root), limit(5000 << 10, LimitSource::Machine));
        write(root, "proc/self/status", "Name: x\nVmRSS:\t     100 kB\n");
        assert_eq!(limit_below(root), limit(5100 << 10, LimitSource::Machine));

        // Version 2: the group itself has no limit, but its parent has.
        write(root, "proc/self/cgroup", "0::/farm/job\n");
        write(root, "sys/fs/cgroup/farm/job/memory.max", "max\n");
        assert_eq!(limit_below(root), limit(5100 << 10, LimitSource::Machine));
        write(root, "sys/fs/cgroup/farm/memory.max", "2048000\n");
        write(root, "sys/fs/cgroup/farm/memory.current", "1048000\n");
        write(
            root,
            "sys/fs/cgroup/farm/memory.stat",
            "anon 7\ninactive_file 24000\nactive_file 24000\n",
        );
        let left = 2_048_000 - 1_000_000 + (100 << 10);
        assert_eq!(limit_below(root), limit(left, LimitSource::ControlGroup));

        // Version 1, in a container where the path of the host is not visible
        write(root, "proc/self/cgroup", "9:cpu,memory:/docker/7\n3:pids:/x\n");
        write(
            root,
            "sys/fs/cgroup/memory/memory.limit_in_bytes",
            "9223372036854771712\n",
        );
        assert_eq!(limit_below(root), limit(5100 << 10, LimitSource::Machine));
        write(root, "sys/fs/cgroup/memory/memory.limit_in_bytes", "3000000\n");
        assert_eq!(
            limit_below(root),
            limit(3_000_000 + (100 << 10), LimitSource::ControlGroup)
        );
    }
}
