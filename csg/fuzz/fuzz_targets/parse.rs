//! For any input, the parser returns a geometry or messages; it never panics, hangs or overflows the
//! stack.
#![no_main]

libfuzzer_sys::fuzz_target!(|source: &[u8]| match csg::language::parse_geometry_bytes(source, "fuzz.geo") {
    Ok(parsed) => {
        let (surfaces, known) = (parsed.geometry.surfaces.len(), parsed.geometry.surface_info.len());
        assert_eq!(surfaces, known, "one entry of surface_info per surface");
        parsed.warnings.iter().for_each(|warning| check_position(source, warning));
    }
    Err(failed) => {
        assert!(failed.errors().count() > 0, "a rejected file has at least one error");
        failed.messages.iter().for_each(|message| check_position(source, message));
    }
});

/// Checks that a message has a position within the text.
fn check_position(source: &[u8], message: &csg::language::Diagnostic) {
    let text = String::from_utf8_lossy(source);
    let (line, column) = (message.span.line as usize, message.span.column as usize);
    assert!(line >= 1 && line <= text.split(['\n', '\r']).count(), "{message}");
    assert!(column >= 1 && column <= message.source_line.chars().count() + 1, "{message}");
}
