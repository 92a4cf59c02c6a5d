//! What a program for a Cortex-M weighs, and who calls whom in it.
use anyhow::{Context, Result};
use object::{Object, ObjectSection, ObjectSegment, ObjectSymbol, SymbolKind};
use std::collections::{BTreeMap, BTreeSet};

const RAM_START: u64 = 0x2000_0000;

/// An ELF file for a Cortex-M.
pub(super) struct Program<'a> {
    file: object::File<'a>,
    /// Functions by address: size and name.
    functions: BTreeMap<u64, (u64, &'a str)>,
}

impl<'a> Program<'a> {
    pub(super) fn parse(bytes: &'a [u8]) -> Result<Self> {
        let file = object::File::parse(bytes)?;
        let mut functions = BTreeMap::new();
        for symbol in file.symbols().filter(|symbol| symbol.kind() == SymbolKind::Text && symbol.size() > 0) {
            // The lowest bit says that it is Thumb code.
            functions.insert(symbol.address() & !1, (symbol.size(), symbol.name()?));
        }
        Ok(Self { file, functions })
    }

    /// Bytes that are loaded, and bytes of RAM that are named.
    pub(super) fn flash_and_ram(&self) -> [u64; 2] {
        let loaded = self.file.segments().map(|segment| segment.file_range().1).sum();
        let in_ram = self.file.segments().filter(|segment| segment.address() >= RAM_START);
        [loaded, in_ram.map(|segment| segment.size()).sum()]
    }

    /// Names of all functions that the one with `part` in its name calls, directly or not, itself included.
    pub(super) fn called_from(&self, part: &str) -> Result<BTreeSet<&'a str>> {
        let root =
            self.functions.iter().find(|(_, (_, name))| name.contains(part)).context("no such function")?;
        let (mut names, mut left) = (BTreeSet::new(), vec![*root.0]);
        while let Some(address) = left.pop() {
            let Some((size, name)) = self.functions.get(&address) else { continue };
            if names.insert(*name) {
                left.extend(self.branches(address, *size));
            }
        }
        Ok(names)
    }

    /// Where the branches of a function go that leave it.
    fn branches(&self, address: u64, size: u64) -> Vec<u64> {
        let section = self
            .file
            .sections()
            .find(|section| (section.address()..section.address() + section.size()).contains(&address));
        let code =
            section.and_then(|section| section.data_range(address, size).ok().flatten()).unwrap_or_default();
        let (halves, _) = code.as_chunks::<2>();
        let halves: Vec<u16> = halves.iter().map(|half| u16::from_le_bytes(*half)).collect();
        let targets = halves.windows(2).enumerate().filter_map(|(place, pair)| {
            let target = branch_target(address + 2 * place as u64, [*pair.first()?, *pair.get(1)?])?;
            (!(address..address + size).contains(&target)).then_some(target)
        });
        // Data between the code may look like a branch: then to no function's beginning.
        targets.filter(|target| self.functions.contains_key(target)).collect()
    }
}

/// Where `BL` or the long `B` at an address goes (Arm DDI 0403, A7.7.12 and A7.7.18, encodings T4 and T1).
fn branch_target(address: u64, [first, second]: [u16; 2]) -> Option<u64> {
    if first >> 11 != 0b11110 || second & 0x9000 != 0x9000 {
        return None;
    }
    let (sign, j1, j2) =
        (u32::from(first >> 10 & 1), u32::from(second >> 13 & 1), u32::from(second >> 11 & 1));
    let high = sign << 24 | (j1 ^ sign ^ 1) << 23 | (j2 ^ sign ^ 1) << 22;
    let offset = high | u32::from(first & 0x3ff) << 12 | u32::from(second & 0x7ff) << 1;
    let signed = (offset << 7) as i32 >> 7;
    Some((address + 4).wrapping_add_signed(signed.into()) & 0xffff_ffff)
}

/// Whether a function of the run-time library computes in double precision: `__aeabi_dadd` and the like, by either name.
pub(super) fn is_double(name: &str) -> bool {
    let by_arm =
        name.strip_prefix("__aeabi_").is_some_and(|name| name.starts_with('d') || name.ends_with("2d"));
    // The hash that ends a Rust symbol may hold any letters.
    let path = name.rsplit_once("17h").map_or(name, |(path, _)| path);
    by_arm || ["df3", "dfsf", "sfdf", "sidf", "dfsi"].iter().any(|part| path.contains(part))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn double_precision_is_known_by_its_names() {
        for name in
            ["__aeabi_dadd", "__aeabi_f2d", "_ZN17compiler_builtins5float3add8__adddf317h0E", "__extendsfdf2"]
        {
            assert!(is_double(name), "{name}");
        }
        assert!(!is_double("_ZN14monorange_core5lines11edge_search10EdgeSearch3row17hdf344ee8eef95a0eE"));
        for name in ["__aeabi_fadd", "__aeabi_memcpy", "__aeabi_uldivmod", "_ZN4core3ops8function"] {
            assert!(!is_double(name), "{name}");
        }
    }

    #[test]
    fn branches_go_where_the_disassembler_says() {
        // 103e2: bl 0xc0c8; 10942: b.w 0x20a8c
        assert_eq!(branch_target(0x103e2, [0xf7fb, 0xfe71]), Some(0xc0c8));
        assert_eq!(branch_target(0x10942, [0xf010, 0xb8a3]), Some(0x20a8c));
        assert_eq!(branch_target(0x100, [0xbf00, 0xbf00]), None);
    }
}
