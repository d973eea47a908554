// A button at every table that puts its cells into the clipboard, with tabs between.
for (const box of document.querySelectorAll(".table")) {
  const button = document.createElement("button");
  button.className = "copy";
  button.textContent = "copy table";
  button.addEventListener("click", async () => {
    const rows = [...box.querySelectorAll("tr")].map((row) =>
      [...row.cells].map((cell) => cell.innerText.trim().replace(/\s+/g, " ")).join("\t")
    );
    button.textContent = (await copied(rows.join("\n"))) ? "copied" : "cannot copy here";
    setTimeout(() => (button.textContent = "copy table"), 1500);
  });
  box.before(button);
}

async function copied(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    const area = document.createElement("textarea");
    area.value = text;
    document.body.append(area);
    area.select();
    const done = document.execCommand("copy");
    area.remove();
    return done;
  }
}
